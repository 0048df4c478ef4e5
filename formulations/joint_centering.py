"""Joint centring in the null space: gradient projection."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np

from dikbench.array import Array
from dikbench.errors import DikbenchError
from dikbench.linear_algebra import inverse_and_row_space
from dikbench.problem import DikProblem, Solve


@dataclass(frozen=True)
class JointCentering:
    """Gradient projection: do the task, and with what it leaves free move to mid-range.

        v = J^+ V + N v_2,   v_2 = -k (q - q_mid),   N = I - J^+ J

    J (m, nv) and V (m,) are the primary task's, in the task frame; v in rad/s; q_mid the middle of
    the position limits, coordinate by coordinate: a joint without a limit on either side is not
    centred. Other tasks are not looked at (`nullspace` with a posture task goes to any posture).
    With damping J^+ becomes J^T (J J^T + lambda^2 I)^-1. Keeps joints away from their limits on
    the way, without promising it, and asks for self-motion even where there is no need.

    Attributes:
        gain: k [1/s].
        rank_tolerance: singular values up to this count as zero (absolute, units of J).
        damping: lambda, unsquared (units of J).
        projector: what becomes of N under damping: `exact` keeps it; `damped` puts the damped
            inverse into it and leaks into the task.

    Source: [Liegeois1977]; Tedrake, Robotic Manipulation, ch. 3 (joint centring).
    """

    gain: float = 1.0
    rank_tolerance: float = 1e-6
    damping: float = 0.0
    projector: Literal["exact", "damped"] = "exact"

    def __post_init__(self) -> None:
        """Check the parameters."""
        for name in ("gain", "rank_tolerance", "damping"):
            if not 0 <= getattr(self, name) < np.inf:
                raise DikbenchError(f"joint-centering: {name} must be finite and at least 0")

    def velocity(self, problem: DikProblem, solve: Solve) -> Array:
        """See `Formulation`."""
        task, coordinates = problem.primary, problem.limits.coordinates
        inverse, rows = inverse_and_row_space(task.J, self.rank_tolerance, self.damping)
        v: Array = inverse @ task.V
        if coordinates is None:
            return v
        has_middle, middle = problem.limits.joint.middle
        wish = self.gain * has_middle * (middle - coordinates)
        if self.projector == "exact":
            return v + wish - (rows @ wish) @ rows
        return v + wish - inverse @ (task.J @ wish)
