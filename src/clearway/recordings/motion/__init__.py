"""How one body moved: markers fitted, names put right, gaps, filter, rest, uncertainty; tracks likewise."""
