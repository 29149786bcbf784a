"""Trials out again: as bags, trajectories, tables, and as motion capture would have seen them."""
