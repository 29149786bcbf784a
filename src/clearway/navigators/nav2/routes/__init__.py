"""Routes on a graph of places, as Nav2's route server plans them (nav2_route)."""
