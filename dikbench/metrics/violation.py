"""How far, how often and how long the integrated motion is outside the limits in force."""

from __future__ import annotations

import numpy as np

from dikbench.arrays import Array
from dikbench.metrics.metric import INF, NEGLIGIBLE, Metric, largest, mean
from dikbench.metrics.motion import Motion


def _peak_ratio(motion: Motion) -> float:
    limit = motion.scenario.robot.limits.velocity
    v = motion.trace.applied
    if limit is None or not len(v):
        return float("nan")
    return float(limit.usage(v).max())


def _violating_share(motion: Motion) -> float:
    excess = np.maximum(motion.position_excess[1:], motion.velocity_excess)
    return mean(excess > NEGLIGIBLE)


def _acceleration_share(motion: Motion) -> float:
    """A change of velocity by up to `NEGLIGIBLE` too much is a solver's tolerance."""
    return mean(motion.acceleration_excess > NEGLIGIBLE / motion.trace.dt)


def _integral(excess: Array, motion: Motion) -> float:
    return float(excess.sum()) * motion.trace.dt


VIOLATION = (
    Metric(
        "velocity_peak_ratio", "", "low", INF, "limit violation",
        "largest joint speed of the motion over its limit",
        _peak_ratio,
    ),
    Metric(
        "position_violation_max_rad", "rad", "low", INF, "limit violation",
        "largest distance of a joint outside its position limits",
        lambda m: largest(m.position_excess),
    ),
    Metric(
        "position_violation_share", "", "low", 1.0, "limit violation",
        "share of the steps that end outside a position limit by > 1e-4 rad",
        lambda m: mean(m.position_excess[1:] > NEGLIGIBLE),
    ),
    Metric(
        "position_violation_integral_rad_s", "rad s", "low", INF, "limit violation",
        "time integral of the largest distance of a joint outside its position limits",
        lambda m: _integral(m.position_excess[1:], m),
    ),
    Metric(
        "velocity_violation_max_rad_s", "rad/s", "low", INF, "limit violation",
        "largest joint speed above its limit",
        lambda m: largest(m.velocity_excess),
    ),
    Metric(
        "velocity_violation_share", "", "low", 1.0, "limit violation",
        "share of the steps in which a joint is too fast by > 1e-4 rad/s",
        lambda m: mean(m.velocity_excess > NEGLIGIBLE),
    ),
    Metric(
        "velocity_violation_integral_rad", "rad", "low", INF, "limit violation",
        "time integral of the largest joint speed above its limit",
        lambda m: _integral(m.velocity_excess, m),
    ),
    Metric(
        "acceleration_violation_max_rad_s2", "rad/s^2", "low", INF, "limit violation",
        "largest joint acceleration above its limit; 0 where none is in force",
        lambda m: largest(m.acceleration_excess),
    ),
    Metric(
        "acceleration_violation_share", "", "low", 1.0, "limit violation",
        "share of the steps whose velocity changes too much, by > 1e-4 rad/s in the step",
        _acceleration_share,
    ),
    Metric(
        "acceleration_violation_integral_rad_s", "rad/s", "low", INF, "limit violation",
        "time integral of the largest joint acceleration above its limit",
        lambda m: _integral(m.acceleration_excess, m),
    ),
    Metric(
        "violating_share", "", "low", 1.0, "limit violation",
        "share of the steps that end outside a position limit or move too fast, by > 1e-4",
        _violating_share,
    ),
)  # fmt: skip
