"""Clearway's own: a heuristic plan through space and time, tracked by a tube MPC, with a certificate before each step."""
