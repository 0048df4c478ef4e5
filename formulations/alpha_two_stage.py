"""Alpha scaling, then the posture in the null space."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated, ClassVar

import numpy as np

from dikbench.problem import (
    Array,
    Braking,
    DikProblem,
    LimitKind,
    Parameters,
    ProblemPart,
    ProgramKind,
    QuadraticProgram,
    Range,
    Solve,
    null_space,
)
from formulations.drake import posture_of
from formulations.lp_alpha import alpha_program
from formulations.null_space_program import limits_about


@dataclass(frozen=True)
class AlphaTwoStage(Parameters):
    """Alpha scaling in two stages: the task as fast as the limits allow, then the posture.

        1.  alpha*, v_1 = argmax alpha   s.t.  J v = alpha V,  0 <= alpha <= 1,  lo <= v <= hi
        2.  z* = argmin 1/2 ||v_1 + N z - v_2||^2   s.t.  lo <= v_1 + N z <= hi,   v = v_1 + N z*

    J (m, nv) and V (m,) are the primary task's, in the task frame; v in rad/s; N (nv, nv - rank J)
    an orthonormal basis of the null space of J; v_2 = gain e the desired velocity of the
    posture task, zero where there is none. lo and hi are the velocity box; both stages keep
    G v <= h as well, where the scenario bounds torques and distances. Stage 2 moves in the null
    space only: posed with J v = alpha* V as an equality, solvers find it infeasible by
    rounding. Drake's single weighted cost approximates it. No direction errors and inside every
    limit; ignores weights.

    Attributes:
        rank_tolerance: singular values up to this count as zero (absolute, units of J).
        braking: how the box approaches a position limit (see `dikbench.problem.velocity_box`).

    Source: our own; stage 1 is that of [Tedrake], stage 2 the lexicographic order of [Kanoun2011].
    """

    rank_tolerance: Annotated[float, Range(0.0)] = 1e-6
    braking: Braking = "viable"

    program: ClassVar[ProgramKind] = "lp"
    keeps: ClassVar[frozenset[LimitKind]] = frozenset(
        {"position", "velocity", "acceleration", "inequalities"}
    )
    sees: ClassVar[frozenset[ProblemPart]] = frozenset({"postures"})

    def velocity(self, problem: DikProblem, solve: Solve) -> Array:
        """See `Formulation`."""
        task, box = problem.primary, problem.box(self.braking)
        n = problem.robot.nv
        first = solve(alpha_program(task, box, 0.0, problem.G, problem.h))[:n]
        N = null_space(task.J, self.rank_tolerance)
        k = N.shape[1]
        if not k:
            return first
        posture, _ = posture_of(problem)
        G, h = limits_about(first, N, box, problem)
        z = solve(QuadraticProgram(np.eye(k), N.T @ (first - posture), G, h))
        v: Array = first + N @ z
        return v
