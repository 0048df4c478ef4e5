"""Task priority without algorithmic singularities."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np

from dikbench.array import Array
from dikbench.errors import DikbenchError
from dikbench.linear_algebra import inverse_and_row_space
from dikbench.problem import DikProblem, Solve


@dataclass(frozen=True)
class NullspaceRobust:
    """Singularity-robust task priority: solve each task alone, then project what it asks for.

        v = J_1^+ V_1 + N_1 J_2^+ V_2 + N_12 J_3^+ V_3 + ...

    over the priority levels k = 1, 2, ..., with N_1..k the projector onto the null space of J_1 to
    J_k stacked; J_k (m_k, nv) and V_k (m_k,) are level k's, poses in the task frame; v in rad/s.
    Protects the first task exactly and stays bounded where two tasks become dependent, each alone
    being regular; pays with the second task, which is not done exactly even where it could be
    unless the tasks are orthogonal (J_1 J_2^T = 0). Knows no limits. With damping every inverse
    J_k^+ becomes J_k^T (J_k J_k^T + lambda^2 I)^-1. Weights play no part.

    Attributes:
        rank_tolerance: singular values up to this count as zero (absolute, units of J_k).
        damping: lambda, unsquared (units of J_k).
        projector: what becomes of the projectors under damping: `exact` keeps them; `damped` makes
            them of damped inverses too and leaks into the tasks above.

    Source: [Chiaverini1997]; [Antonelli2009] for more than two tasks; the lecture notes' second
    form (Tedrake, Robotic Manipulation, ch. 3).
    """

    rank_tolerance: float = 1e-6
    damping: float = 0.0
    projector: Literal["exact", "damped"] = "exact"

    def __post_init__(self) -> None:
        """Check the parameters."""
        for name in ("rank_tolerance", "damping"):
            if not 0 <= getattr(self, name) < np.inf:
                raise DikbenchError(f"nullspace-robust: {name} must be finite and at least 0")

    def velocity(self, problem: DikProblem, solve: Solve) -> Array:
        """See `Formulation`."""
        first, *others = problem.levels
        inverse, taken = self._inverse_and_taken(first.J)
        v: Array = inverse @ first.V
        N = np.eye(problem.robot.nv)
        for above, level in zip([first, *others], others, strict=False):
            if above is not first:
                _, taken = self._inverse_and_taken(above.J @ N)
            N = N - taken
            inverse, _ = self._inverse_and_taken(level.J)
            v = v + N @ (inverse @ level.V)
        return v

    def _inverse_and_taken(self, A: Array) -> tuple[Array, Array]:
        """The inverse of A (m, n) and, (n, n), what A takes from the projector before it."""
        inverse, rows = inverse_and_row_space(A, self.rank_tolerance, self.damping)
        return inverse, rows.T @ rows if self.projector == "exact" else inverse @ A
