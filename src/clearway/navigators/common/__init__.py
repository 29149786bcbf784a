"""What several navigators use: their inputs checked, arrival, what a base can do next, the tracking MPC."""
