"""Who decides for the bodies in the world that are not tested: one file each, and a line in `registry.py`."""
