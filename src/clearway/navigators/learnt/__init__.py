"""Navigators that were learnt: a policy of numbers, between what it sees and what it says."""
