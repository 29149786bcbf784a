"""What is true: moves robots and obstacles, senses, notices contact; simulate() runs one trial."""

from clearway.world.simulate import Simulation, simulate, simulate_all, simulate_in, simulation_of

__all__ = ["Simulation", "simulate", "simulate_all", "simulate_in", "simulation_of"]
