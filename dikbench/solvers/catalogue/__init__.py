"""The known solvers and their settings."""
