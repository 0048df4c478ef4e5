"""How near the motion came to obstacles and to itself, and what its torques were."""

from __future__ import annotations

from typing import Final

import numpy as np

from dikbench.metrics.metric import INF, Metric, largest, mean
from dikbench.metrics.motion import Motion

TORQUE_TOLERANCE: Final = 1e-6
"""A torque beyond its limit by less than this share of it is a solver's tolerance."""


def _shortfall(motion: Motion) -> float:
    """How far the least distance was below the margin, 0 where it never was."""
    room = largest(-motion.clearance)
    return room if np.isnan(room) else max(room, 0.0)


CONSTRAINTS = (
    Metric(
        "distance_min_m", "m", "high", -INF, "limit violation",
        "smallest distance from an obstacle, or between two links, that a constraint is about",
        lambda m: -largest(-m.distances),
    ),
    Metric(
        "distance_violation_max_m", "m", "low", INF, "limit violation",
        "how far a distance was below the margin that a constraint keeps",
        _shortfall,
    ),
    Metric(
        "distance_remainder_max_m", "m", "low", INF, "limit violation",
        "by how much a distance fell below its linearisation in one step: the second-order term",
        lambda m: largest(m.distance_remainders),
    ),
    Metric(
        "torque_usage_max", "", "low", INF, "limit violation",
        "largest joint torque (recursive Newton-Euler) over its limit, where torques are limited",
        lambda m: largest(m.torque_usage),
    ),
    Metric(
        "torque_violating_share", "", "low", 1.0, "limit violation",
        "share of the steps in which a torque passes its limit by more than 1e-6 of it",
        lambda m: mean(m.torque_usage > 1 + TORQUE_TOLERANCE),
    ),
)  # fmt: skip
