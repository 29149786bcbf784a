"""The test plan at work: what it says, what is wrong with it, and a Trial of each of its trials."""
