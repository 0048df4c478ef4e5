"""The nearness of every joint to its limits at every control step."""

from __future__ import annotations

from enum import IntEnum
from typing import Final

import numpy as np
import numpy.typing as npt

from dikbench.arrays import Array
from dikbench.metrics import VIOLATION_TOLERANCE
from dikbench.robots.limits import JointLimits
from dikbench.simulation.trace import Trace

NEAR_SHARE: Final = 0.9
"""Share of a limit from which a joint counts as near it."""


class Nearness(IntEnum):
    """The relation of a joint to the limits of its position and speed."""

    INSIDE = 0
    NEAR = 1
    PAST = 2


def nearness(trace: Trace, limits: JointLimits) -> npt.NDArray[np.int_]:
    """Classify every joint, (n + 1, nv): before each step, with its speed, and at the end.

    A joint is past a limit if it exceeds it by more than `VIOLATION_TOLERANCE`, as in the metrics.
    """
    use, excess = np.zeros((2, trace.steps + 1, limits.nv))
    position, speed = limits.position, limits.velocity
    if position is not None:
        at = trace.q[:, limits.q_index]
        use = _share_of_range(at, position.lower, position.upper)
        excess = np.maximum(at - position.upper, position.lower - at)
    if speed is not None:
        v = trace.applied
        use[:-1] = np.maximum(use[:-1], speed.usage(v))
        too_fast = np.maximum(v - speed.upper, speed.lower - v)
        excess[:-1] = np.maximum(excess[:-1], too_fast)
    near = np.where(use >= NEAR_SHARE, Nearness.NEAR, Nearness.INSIDE)
    return np.where(excess > VIOLATION_TOLERANCE, Nearness.PAST, near)


def _share_of_range(at: Array, lower: Array, upper: Array) -> Array:
    """Compute the distance from mid-range over half the range; 0 where it is unbounded."""
    with np.errstate(invalid="ignore"):  # infinity minus infinity
        middle, half = (lower + upper) / 2, (upper - lower) / 2
        share = np.abs(at - middle) / half
    bounded: Array = np.where(np.isfinite(half), share, 0.0)
    return bounded
