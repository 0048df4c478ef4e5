"""Lexicographic quadratic programs: each level moves in the null space of those above."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated, ClassVar

import numpy as np

from dikbench.errors import SolverFailed
from dikbench.problem import (
    Array,
    Box,
    Braking,
    DikProblem,
    Drawn,
    LimitKind,
    Parameters,
    ProblemPart,
    ProgramKind,
    QuadraticProgram,
    Range,
    Solve,
    null_space,
)
from formulations.null_space_program import limits_about

UPPER_LEVEL_DAMPING = 1e-5
"""Damping of the levels above the last, which makes their programs strictly convex; a task loses
(1e-5/sigma)^2 of its velocity along a direction with the singular value sigma."""

ATTEMPTS_PER_LOWER_LEVEL = 4
"""Solves of a level below the first, each with ten times the previous damping: z = 0 is feasible,
but active-set methods find bounds contradictory that are nearly parallel in a hardly damped
direction."""


@dataclass(frozen=True)
class HierarchicalQp(Parameters):
    """Strict priorities inside the limits: a quadratic program per priority level.

        level k:  min_(v, w_k)  1/2 ||w_k||^2
                  s.t.  J_k v = V_k + w_k,   J_j v = V_j + w_j* for j < k,   lo <= v <= hi,
                        G v <= h   (torques and distances, where the scenario bounds them)

    over the priority levels k = 1, ..., K; J_k (m_k, nv) and V_k (m_k,) are level k's rows
    multiplied by the square roots of their weights, poses in the task frame; v in rad/s; lo and hi
    the velocity box. The last level adds 1/2 lambda^2 ||v||^2, the others do with lambda = 1e-5;
    below the first, where the solver fails, ten times more is tried, up to a thousand times.
    The results of the levels above are kept exactly by moving in the null space of their rows,
    v = v_(k-1) + N z. With one level it is `qp`, without active bounds `nullspace`. Singular where
    a task is, but inside the limits; direction errors where a bound is active.

    Attributes:
        damping: lambda, unsquared, of the last level.
        rank_tolerance: singular values up to this count as zero (absolute, units of weighted J_k).
        braking: how the box approaches a position limit (see `dikbench.problem.velocity_box`).

    Source: [Kanoun2011]; [Escande2014].
    """

    damping: Annotated[float, Range(0.0), Drawn(1e-4, 0.1, log=True)] = 1e-3
    rank_tolerance: Annotated[float, Range(0.0)] = 1e-6
    braking: Braking = "viable"

    program: ClassVar[ProgramKind] = "qp"
    keeps: ClassVar[frozenset[LimitKind]] = frozenset(
        {"position", "velocity", "acceleration", "inequalities"}
    )
    sees: ClassVar[frozenset[ProblemPart]] = frozenset({"lower-tasks", "weights"})

    def velocity(self, problem: DikProblem, solve: Solve) -> Array:
        """See `Formulation`."""
        n, box, levels = problem.robot.nv, problem.box(self.braking), problem.levels
        v, N = np.clip(np.zeros(n), box.lower, box.upper), np.eye(n)
        for number, level in enumerate(levels):
            if not N.shape[1]:
                break
            scale = np.sqrt(np.broadcast_to(level.weight, level.V.shape))
            A = scale[:, None] * level.J @ N
            last = number == len(levels) - 1
            damping = self.damping if last else UPPER_LEVEL_DAMPING
            r = scale * (level.V - level.J @ v)
            for attempts_left in reversed(range(ATTEMPTS_PER_LOWER_LEVEL if number else 1)):
                try:
                    z = solve(_level(A, r, v, N, box, damping, problem))
                    break
                except SolverFailed:
                    if not attempts_left:
                        raise
                    damping = max(10 * damping, UPPER_LEVEL_DAMPING)
            v = v + N @ z
            if not last:
                free = null_space(A, self.rank_tolerance)
                if free.shape[1] < N.shape[1]:
                    N = N @ free
        return v


def _level(
    A: Array, r: Array, v: Array, N: Array, box: Box, damping: float, problem: DikProblem
) -> QuadraticProgram:
    """Pose the program of one level in z.

    min 1/2 ||A z - r||^2 + 1/2 damping^2 ||v + N z||^2   s.t.   the limits on v + N z
    """
    k = N.shape[1]
    P = A.T @ A + damping**2 * np.eye(k)  # N is orthonormal
    q = -A.T @ r + damping**2 * (N.T @ v)
    if k == len(v):  # no level above has used a direction: N = I
        h = None if problem.G is None or problem.h is None else problem.h - problem.G @ v
        return QuadraticProgram(P, q, problem.G, h, lb=box.lower - v, ub=box.upper - v)
    return QuadraticProgram(P, q, *limits_about(v, N, box, problem))
