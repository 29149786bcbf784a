"""Paper B's heuristic planner: the shortest way among discs, and what moves as belts of them."""
