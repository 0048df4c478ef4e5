"""Which cells to run: studies, trials, their identity."""
