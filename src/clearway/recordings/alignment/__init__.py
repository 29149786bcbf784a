"""Ties between sources: their frames to the map, their clocks to each other."""
