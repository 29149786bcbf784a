"""One pure function an indicator: Trial -> number with a unit, or not computable, because."""
