"""Violations of the limits in force by the integrated motion: size, frequency, duration."""

from __future__ import annotations

from collections.abc import Callable
from typing import Final

import numpy as np

from dikbench.arrays import Array, Mask
from dikbench.metrics.metric import INF, Metric, series_metrics, unit_suffix
from dikbench.metrics.motion import Motion

VIOLATION_TOLERANCE: Final = 1e-4
"""Excess over a limit [rad, rad/s] up to which a step does not count as a violation, which is a
solver's tolerance; the largest violation has its own column."""


def _velocity_usage(motion: Motion) -> float:
    """Compute the largest joint speed over its limit; NaN of no step, or without limits."""
    if motion.scenario.robot.limits.velocity is None or not motion.trace.steps:
        return float("nan")
    return float(motion.velocity_usage.max())


def _violation(
    quantity: str,
    units: tuple[str, str],
    definition: str,
    excess: Callable[[Motion], Array],
    steps: str,
    tolerance: Callable[[Motion], float] = lambda _: VIOLATION_TOLERANCE,
) -> tuple[Metric, ...]:
    """Make the metrics of one kind of limit: its largest violation, how often, and the integral.

    Args:
        quantity: what is limited.
        units: of the excess, and of its time integral.
        definition: of the excess, such as follows "largest".
        excess: how far beyond its limit the worst joint is, in each step, and perhaps at the start.
        steps: which steps count as violating, such as follows "share of the steps".
        tolerance: the excess from which a step counts.
    """
    name = f"{quantity}_violation"

    def in_steps(motion: Motion) -> Array:
        """Return the excess of each step, (n,), without that at the start."""
        values = excess(motion)
        return values[len(values) - motion.trace.steps :]

    return (
        *series_metrics(name, units[0], definition, excess, "max"),
        *series_metrics(name, "", steps, lambda m: in_steps(m) > tolerance(m), "share"),
        Metric(
            f"{name}_integral_{unit_suffix(units[1])}", units[1], "low", INF,
            f"time integral of the largest {definition}",
            lambda m: float(in_steps(m).sum()) * m.trace.dt,
        ),
    )  # fmt: skip


def _violating(motion: Motion) -> Mask:
    """Return which steps end outside a position limit or are too fast, (n,)."""
    return np.maximum(motion.position_excess[1:], motion.velocity_excess) > VIOLATION_TOLERANCE


VIOLATION = (
    Metric(
        "velocity_peak_ratio", "", "low", INF,
        "largest joint speed of the motion over its limit", _velocity_usage,
    ),
    *_violation(
        "position", ("rad", "rad s"), "distance of a joint outside its position limits",
        lambda m: m.position_excess, "that end outside a position limit by > 1e-4 rad",
    ),
    *_violation(
        "velocity", ("rad/s", "rad"), "joint speed above its limit",
        lambda m: m.velocity_excess, "in which a joint is too fast by > 1e-4 rad/s",
    ),
    *_violation(
        "acceleration", ("rad/s^2", "rad/s"), "joint acceleration above its limit, 0 without one",
        lambda m: m.acceleration_excess,
        "whose velocity changes too much, by > 1e-4 rad/s in the step",
        lambda m: VIOLATION_TOLERANCE / m.trace.dt,
    ),
    *series_metrics(
        "violating", "", "that end outside a position limit or move too fast, by > 1e-4",
        _violating, "share",
    ),
)  # fmt: skip
