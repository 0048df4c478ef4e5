"""A path through placements at given times, along screw motions."""

from __future__ import annotations

from bisect import bisect_right
from collections.abc import Sequence
from itertools import pairwise
from typing import Any

import numpy as np
import pinocchio as pin

from dikbench.arrays import Array
from dikbench.scenario.reference.reference import Reference


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

    def segment(tau: float) -> tuple[int, float]:
        k = min(max(bisect_right(times, tau) - 1, 0), len(twists) - 1)
        return k, min(max((tau - times[k]) / spans[k], 0.0), 1.0)

    def placement(tau: float) -> Any:
        k, u = segment(tau)
        s = u**3 * (10 - 15 * u + 6 * u**2) if smooth else u
        return placements[k] * pin.exp6(pin.Motion(s * twists[k]))

    def velocity(tau: float) -> Array:
        k, u = segment(tau)
        rate = 30 * u**2 * (1 - u) ** 2 if smooth else 1.0
        twist: Array = rate / spans[k] * twists[k]
        return twist

    return Reference(float(times[-1]), placement, velocity)
