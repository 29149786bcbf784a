"""Many trials: the list, the workers, progress, resume."""
