"""The weighted least-norm solution, which slows joints that approach a limit."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated

import numpy as np

from dikbench.problem import Array, DampedInverse, DikProblem, Drawn, Parameters, Range, Solve


@dataclass(frozen=True)
class WeightedLeastNorm(Parameters):
    """Weighted least norm: prefer joints that do not approach a limit.

        min v^T W v  s.t.  J v = V,   v = W^-1 J^T (J W^-1 J^T + lambda^2 I)^-1 V,   W = diag(w)
        w_i = 1 + |dH/dq_i| if v_prev,i dH/dq_i > 0, else 1
        H = sum_i (q_max,i - q_min,i)^2 / (4 (q_max,i - q_i) (q_i - q_min,i))

    J (m, nv) and V (m,) are the primary task's, in the task frame; v in rad/s, v_prev the
    velocity applied last (unknown: w = 1). At and beyond the limit w is infinite; w = 1 for a joint
    without both limits. Does the task exactly where the other joints can and, unlike
    `joint-centering`, pushes no joint away from its limit. v jumps where a joint reverses, a joint
    at rest can pass its limit, and a square J leaves no choice. Keeps no limit; ignores other tasks
    and weights.

    Attributes:
        damping: lambda, unsquared (units of J); 0 by default: the task exactly.
        rank_tolerance: singular values of J W^-1/2 up to this count as zero (absolute, units of J).

    Source: [ChanDubey1995], which weighs a joint at rest too: at its limit that would lock it.
    """

    damping: Annotated[float, Range(0.0), Drawn(1e-3, 0.3, log=True)] = 0.0
    rank_tolerance: Annotated[float, Range(0.0)] = 1e-6

    def velocity(self, problem: DikProblem, solve: Solve) -> Array:
        """See `Formulation`."""
        task, limits = problem.primary, problem.limits
        to_lower, to_upper = limits.to_lower, limits.to_upper
        if to_lower is None or to_upper is None or problem.v_prev is None:
            return DampedInverse(task.J, self.rank_tolerance, self.damping).times(task.V)
        root = np.sqrt(mobility(to_lower, to_upper, problem.v_prev))
        v = DampedInverse(task.J * root, self.rank_tolerance, self.damping).times(task.V)
        return root * v


def mobility(to_lower: Array, to_upper: Array, v_prev: Array) -> Array:
    """Compute 1/w, (nv,), from the distances to the limits and the last velocity, (nv,)."""
    with np.errstate(invalid="ignore"):  # infinite distances
        outwards = v_prev * (to_lower - to_upper) > 0
        product = 4 * (to_lower * to_upper) ** 2
        slope = (to_lower + to_upper) ** 2 * np.abs(to_lower - to_upper)  # |dH/dq| times `product`
        share = product / (product + slope)
    share[(to_lower <= 0) | (to_upper <= 0)] = 0.0
    limited = np.isfinite(to_lower) & np.isfinite(to_upper)
    return np.where(outwards & limited, share, 1.0)
