"""Robots: models, limits, kinematics, the catalogue, and arms that are built in code."""
