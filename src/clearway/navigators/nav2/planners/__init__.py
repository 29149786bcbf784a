"""Nav2's planners: NavFn, Smac 2D, Smac Hybrid-A*."""
