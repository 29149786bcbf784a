"""What several navigators use: their inputs checked, arrival, the tracking MPC of `hp-tmpc` and `hp-st`."""
