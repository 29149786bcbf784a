"""What is true: moves robots and obstacles, senses, notices contact; simulate() runs one trial."""

from clearway.world.simulate import simulate, simulate_all, simulate_in

__all__ = ["simulate", "simulate_all", "simulate_in"]
