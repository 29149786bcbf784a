"""Before the lab: the skeleton of a test plan, and the run sheet to print."""
