"""Published experiments, run again with the formulations here and set beside what was printed."""
