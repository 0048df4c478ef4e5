"""Solvers of quadratic and linear programs: names, interfaces, and the checked call."""
