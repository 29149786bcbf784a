"""What navigators share that drive by model predictive path integral control (MPPI): noise, samples, weights."""
