"""The least-norm velocity in a metric that stiffens joints on their way to a limit."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from dikbench.array import Array
from dikbench.errors import DikbenchError
from dikbench.limits import Limits
from dikbench.linear_algebra import pseudo_inverse
from dikbench.problem import DikProblem, Solve


@dataclass(frozen=True)
class WeightedLeastNorm:
    """Weighted least norm: do the task with the joints that are not running into a limit.

        v = W^-1 J^T (J W^-1 J^T)^-1 V = W^-1/2 (J W^-1/2)^+ V,   W = diag(w)
        w_i = 1 + |dH/dq_i|  where the joint moves towards a limit (v_prev,i dH/dq_i > 0),  else 1
        H = sum_i (q_max,i - q_min,i)^2 / (4 (q_max,i - q_i)(q_i - q_min,i))

    J (m, nv) and V (m,) are the primary task's, in the task frame; v in rad/s; v_prev the velocity
    applied last (None: nothing moves, and the law is the pseudo-inverse). At a limit, and outside
    it, a joint that moves outwards is stopped; before it, one without limits on both sides is free.
    No self-motion without need and no gain to tune, but the weights jump as a joint turns round,
    and nothing is promised: the stopped joint turns back only when the task asks for it.

    Attributes:
        rank_tolerance: singular values of J W^-1/2 up to this count as zero (absolute).

    Source: [ChanDubey1995].
    """

    rank_tolerance: float = 1e-6

    def __post_init__(self) -> None:
        """Check the parameters."""
        if not 0 <= self.rank_tolerance < np.inf:
            raise DikbenchError("weighted-least-norm: rank_tolerance must be finite and at least 0")

    def velocity(self, problem: DikProblem, solve: Solve) -> Array:
        """See `Formulation`."""
        task = problem.primary
        if problem.v_prev is None or problem.limits.coordinates is None:
            v: Array = pseudo_inverse(task.J, self.rank_tolerance) @ task.V
            return v
        gradient = limit_gradient(problem.limits)
        stiffness = np.where(np.sign(gradient) * problem.v_prev > 0, np.abs(gradient), 0.0)
        root = 1 / np.sqrt(1 + stiffness)  # W^-1/2
        v = root * (pseudo_inverse(task.J * root, self.rank_tolerance) @ task.V)
        return v


def limit_gradient(limits: Limits) -> Array:
    """dH/dq_i = (q_max - q_min)^2 (2 q - q_max - q_min) / (4 (q_max - q)^2 (q - q_min)^2), (nv,).

    Infinite, with its sign, at a limit and outside it; else 0 where one of the limits is missing.
    """
    below, above = limits.to_lower, limits.to_upper
    assert below is not None
    assert above is not None
    gradient = np.zeros(len(below))
    inside = (below > 0) & (above > 0) & (limits.joint.middle[0] > 0)
    down, up = below[inside], above[inside]
    with np.errstate(divide="ignore", over="ignore"):  # a hair from a limit it is infinite, too
        gradient[inside] = ((down + up) / (2 * down * up)) ** 2 * (down - up)
    gradient[above <= 0] = np.inf
    gradient[below <= 0] = -np.inf
    return gradient
