"""Paired tests, intervals, effect sizes, correlations, trial planning."""
