"""Better parameters for a navigator: a search on training trials, and what it is worth on held-out ones."""
