"""Paper B's robust tube-based MPC: the tube, the tracking problem, and the solvers that the paper names."""
