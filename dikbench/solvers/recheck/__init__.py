"""Checks of a solver's answer: residuals, feasibility, distance from the optimum."""
