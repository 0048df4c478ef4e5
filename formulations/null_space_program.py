"""The limits of a control step on what moves in a null space: v + N z instead of v."""

from __future__ import annotations

import numpy as np

from dikbench.problem import Array, Box, DikProblem


def limits_about(v: Array, N: Array, box: Box, problem: DikProblem) -> tuple[Array, Array]:
    """Compute rows (p, k) and bounds (p,) on z that keep v + N z inside the limits.

        lo <= v + N z <= hi,   G (v + N z) <= h

    with the velocity box lo, hi and the rows G, h of the problem, without infinite bounds. Where v
    is outside, by the tolerance of the solver that found it, the bound is moved to v, so that z = 0
    is feasible.

    Args:
        v: the velocity so far, (nv,) [rad/s].
        N: orthonormal basis of the null space, (nv, k).
        box: the velocity box.
        problem: the control step.
    """
    rows, slack = [N, -N], [box.upper - v, v - box.lower]
    if problem.G is not None and problem.h is not None:
        rows.append(problem.G @ N)
        slack.append(problem.h - problem.G @ v)
    bounds = np.maximum(np.concatenate(slack), 0.0)
    bounded = np.isfinite(bounds)
    return np.vstack(rows)[bounded], bounds[bounded]
