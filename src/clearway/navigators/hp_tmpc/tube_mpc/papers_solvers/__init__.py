"""The two solvers that paper B names, kept to compare with: `hp-tmpc[solver=genetic]`, `hp-tmpc[solver=pattern-search]`."""
