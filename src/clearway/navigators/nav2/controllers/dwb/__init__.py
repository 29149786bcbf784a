"""Nav2's DWB: the dynamic window approach with critics that a file chooses."""
