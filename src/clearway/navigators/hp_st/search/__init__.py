"""Ways through space and time, and those of them that are worth being tracked."""
