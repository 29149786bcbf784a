"""What decides: the registry, the conformance check; a folder or a file a method."""
