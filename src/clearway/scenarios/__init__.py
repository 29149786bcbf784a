"""What is asked: floor plan, task, obstacles and their motion, seed; and the suites that ask it."""
