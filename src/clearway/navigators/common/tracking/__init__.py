"""The tracking MPC of paper B (eqs. 1-3) that `hp-tmpc` and `hp-st` share: the problem, its solver, the ancillary gain."""
