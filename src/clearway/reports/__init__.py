"""Tables, figures, the page, exports: drawn from a results directory alone."""
