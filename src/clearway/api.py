"""The Python interface: run campaigns and open their results."""
