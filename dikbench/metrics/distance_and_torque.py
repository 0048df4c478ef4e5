"""Distances from obstacles and between links, and joint torques."""

from __future__ import annotations

from typing import Final

import numpy as np

from dikbench.metrics.metric import series_metrics

RELATIVE_TORQUE_TOLERANCE: Final = 1e-6
"""Share of a limit by which a torque may exceed it, which is a solver's tolerance."""

CONSTRAINTS = (
    *series_metrics(
        "distance", "m", "distance that a constraint keeps, from an obstacle or between two links",
        lambda m: m.distances, "min", best="high",
    ),
    *series_metrics(
        "distance_violation", "m", "shortfall of a distance below the margin of its constraint",
        lambda m: np.maximum(-m.clearance, 0.0), "max",
    ),
    *series_metrics(
        "distance_remainder", "m",
        "fall of a distance below its linearisation in one step: the second-order term",
        lambda m: m.distance_remainders, "max",
    ),
    *series_metrics(
        "torque_usage", "",
        "joint torque (recursive Newton-Euler) over its limit, where torques are limited",
        lambda m: m.torque_usage, "max",
    ),
    *series_metrics(
        "torque_violating", "", "in which a torque passes its limit by more than 1e-6 of it",
        lambda m: m.torque_usage > 1 + RELATIVE_TORQUE_TOLERANCE, "share",
    ),
)  # fmt: skip
