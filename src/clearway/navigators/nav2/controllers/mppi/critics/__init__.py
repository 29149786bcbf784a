"""MPPI's critics: each adds a cost to every sample."""
