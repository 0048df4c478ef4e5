"""The solvers that there are, and their settings."""
