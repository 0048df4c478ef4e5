"""The closed loop, one control step of it, and its record."""
