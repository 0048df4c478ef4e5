"""A path through placements at given times: along screw motions, or held from each to the next."""

from __future__ import annotations

from bisect import bisect_right
from collections.abc import Sequence
from itertools import pairwise
from typing import Any

import numpy as np
import pinocchio as pin

from dikbench.arrays import Array, Indices
from dikbench.scenario.reference.embedded_path import SAME_INSTANT_S
from dikbench.scenario.reference.reference import Placed, Placement, Reference
from dikbench.scenario.reference.screws import composed, exp6


def through(times: Sequence[float], placements: Sequence[Any], *, smooth: bool) -> Reference:
    """Interpolate placements in SE(3).

        X_d(tau) = X_k exp6(s log6(X_k^-1 X_k+1)),   s = u or u^3 (10 - 15 u + 6 u^2),
        u = (tau - t_k) / (t_k+1 - t_k)

    Args:
        times: increasing, from 0 on, at least two [s].
        placements: one per time (`pinocchio.SE3`).
        smooth: whether each segment begins and ends at rest with least jerk (Flash & Hogan 1985),
            or has a constant speed, which then jumps between segments.
    """
    twists = [pin.log6(here.actInv(there)).np for here, there in pairwise(placements)]
    spans = np.diff(times)
    rounding = 0.0 if smooth else SAME_INSTANT_S  # at rest there is no other velocity to take

    def placement(tau: float) -> Any:
        k, u = segment_at(times, tau, rounding)
        s = u**3 * (10 - 15 * u + 6 * u**2) if smooth else u
        return placements[k] * pin.exp6(pin.Motion(s * twists[k]))

    whole = np.array(twists)
    R, p = np.array([X.rotation for X in placements]), np.array([X.translation for X in placements])

    def many(at: Array) -> Placed:
        k, u = segments_at(times, at, rounding)
        s = u**3 * (10 - 15 * u + 6 * u**2) if smooth else u
        return composed(R[k], p[k], exp6(s[:, None] * whole[k]))

    def velocity(tau: float) -> Array:
        k, u = segment_at(times, tau, rounding)
        rate = 30 * u**2 * (1 - u) ** 2 if smooth else 1.0
        twist: Array = rate / spans[k] * twists[k]
        return twist

    return Reference(float(times[-1]), Placement(placement, many), velocity)


def held(times: Sequence[float], placements: Sequence[Any]) -> Reference:
    """Hold each placement until the time of the next one, at rest.

    Args:
        times: increasing, from 0 on, at least two [s].
        placements: one per time (`pinocchio.SE3`).
    """
    zero = np.zeros(6)

    def placement(tau: float) -> Any:
        k, u = segment_at(times, tau)
        return placements[k + (u == 1.0)]

    return Reference(float(times[-1]), placement, lambda tau: zero)


def segment_at(
    times: Sequence[float], tau: float, rounding: float = SAME_INSTANT_S
) -> tuple[int, float]:
    """Find the segment between two times in which tau lies, and its share of the segment.

    Args:
        times: increasing, at least two [s].
        tau: [s]; before the first time and after the last one it is at these.
        rounding: a tau so little before a time belongs to the segment that begins there [s].
    """
    k = min(max(bisect_right(times, tau + rounding) - 1, 0), len(times) - 2)
    return k, min(max((tau - times[k]) / (times[k + 1] - times[k]), 0.0), 1.0)


def segments_at(
    times: Sequence[float], at: Array, rounding: float = SAME_INSTANT_S
) -> tuple[Indices, Array]:
    """Find the segments and the shares (n,) of several times (n,) [s] (see `segment_at`)."""
    ends = np.asarray(times)
    k = np.clip(np.searchsorted(ends, at + rounding, side="right") - 1, 0, len(ends) - 2)
    return k, np.clip((at - ends[k]) / (ends[k + 1] - ends[k]), 0.0, 1.0)
