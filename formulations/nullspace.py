"""Strict task priority by null-space projection."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated, ClassVar

import numpy as np

from dikbench.problem import (
    Array,
    DampedInverse,
    DikProblem,
    Drawn,
    Parameters,
    ProblemPart,
    Projector,
    Range,
    Solve,
    scaled_identity,
)


@dataclass(frozen=True)
class Nullspace(Parameters):
    """Strict task priority: each task moves in the null space of the tasks above it.

        v_0 = 0,  N_0 = I,  A_k = J_k N_(k-1)
        v_k = v_(k-1) + A_k^# (V_k - J_k v_(k-1))
        N_k = N_(k-1) - A_k^+ A_k   (exact)   or   N_(k-1) - A_k^# A_k   (damped)

    over the priority levels k = 1, 2, ...; J_k (m_k, nv) and V_k (m_k,) are level k's, poses in the
    task frame; A^# = A^T (A A^T + lambda^2 I)^-1; v in rad/s. Does every task as well as those
    above it allow and, with the exact projector, never disturbs them. Without damping it is
    singular wherever a task is, or where two tasks become dependent. The damped "projector" is a
    common mistake: lower tasks disturb those above, and since A_k^# compensates for the damping, a
    posture below the first task nearly replaces it. Ignores limits and weights.

    Attributes:
        damping: lambda, unsquared (units of J); 0 by default: every task exactly.
        projector: whether the null-space projector is exact or damped.
        rank_tolerance: singular values of A_k up to this count as zero (absolute, units of J_k;
            a relative tolerance fails where the null space is empty).

    Source: [Nakamura1987] for two tasks, [SicilianoSlotine1991] for any number.
    """

    damping: Annotated[float, Range(0.0), Drawn(1e-3, 0.3, log=True)] = 0.0
    projector: Projector = "exact"
    rank_tolerance: Annotated[float, Range(0.0)] = 1e-6

    sees: ClassVar[frozenset[ProblemPart]] = frozenset({"lower-tasks"})

    def velocity(self, problem: DikProblem, solve: Solve) -> Array:
        """See `Formulation`."""
        n = problem.robot.nv
        v, N = np.zeros(n), scaled_identity(n, 1.0)
        above: DampedInverse | None = None
        for level in problem.levels:
            if above is not None:
                N = N - above.taken(self.projector)
            above = DampedInverse(level.J.dot(N), self.rank_tolerance, self.damping)
            v = v + above.times(level.V - level.J.dot(v))
        return v
