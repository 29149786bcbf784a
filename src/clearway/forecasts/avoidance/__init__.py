"""Obstacles that keep out of each other's way: further models of motion, each a rule for all that move together."""
