"""The closed loop, one control step of it, and what is recorded."""
