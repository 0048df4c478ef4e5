"""Singularity-robust task priority."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated, ClassVar

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
class NullspaceRobust(Parameters):
    """Task priority without algorithmic singularities: invert each task alone, then project.

        v = sum_k N_(k-1) J_k^# V_k,   two levels:  v = J_1^# V_1 + (I - J_1^+ J_1) J_2^# V_2

    over the priority levels k = 1, 2, ...; N_(k-1) projects into the null space of all levels above
    k, stacked (N_k as in `nullspace`, with its two projectors); J_k (m_k, nv) and V_k (m_k,) are
    level k's, poses in the task frame; J^# = J^T (J J^T + lambda^2 I)^-1; v in rad/s. Bounded
    where two tasks become dependent, unlike `nullspace`; in return the lower task is exact only
    where their row spaces are orthogonal. With the exact projector the tasks above are never
    disturbed. A task's own singularities need damping. Ignores limits and weights.

    Attributes:
        damping: lambda, unsquared (units of J); 0 by default.
        projector: whether the null-space projector is exact or damped.
        rank_tolerance: singular values up to this count as zero (absolute, units of J_k).

    Source: [Chiaverini1997]; more than two levels with the projector of all levels above:
    [Antonelli2009].
    """

    damping: Annotated[float, Range(0.0), Drawn(1e-3, 0.3, log=True)] = 0.0
    projector: Projector = "exact"
    rank_tolerance: Annotated[float, Range(0.0)] = 1e-6

    sees: ClassVar[frozenset[ProblemPart]] = frozenset({"lower-tasks"})

    def velocity(self, problem: DikProblem, solve: Solve) -> Array:
        """See `Formulation`."""
        first, *others = problem.levels
        inverse = DampedInverse(first.J, self.rank_tolerance, self.damping)
        v = inverse.times(first.V)
        N = scaled_identity(problem.robot.nv, 1.0)
        for number, level in enumerate(others, start=2):
            N = N - inverse.taken(self.projector)
            alone = DampedInverse(level.J, self.rank_tolerance, self.damping)
            v = v + N.dot(alone.times(level.V))
            if number <= len(others):  # the levels below need this projector
                inverse = DampedInverse(level.J.dot(N), self.rank_tolerance, self.damping)
        return v
