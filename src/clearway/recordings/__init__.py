"""Real robots in: one reader a format, markers to motion, frames and clocks tied, and a Trial comes out."""
