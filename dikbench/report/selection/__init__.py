"""Which rows a figure shows."""
