"""Drake's function: alpha scaling and joint centring in one weighted program."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated, ClassVar

import numpy as np

from dikbench.problem import (
    Array,
    DikProblem,
    Drawn,
    LimitKind,
    LinearizedJointTask,
    Parameters,
    ProblemPart,
    ProgramKind,
    QuadraticProgram,
    Range,
    Solve,
)
from formulations.lu_kernel import lu_kernel

ALPHA_REWARD = 100.0
"""Weight of alpha relative to the squared null-space velocity."""


@dataclass(frozen=True)
class Drake(Parameters):
    """Alpha scaling as in Drake: progress and joint centring in one weighted cost.

        min_(v, alpha)  -100 alpha + ||P (v - K e)||^2
        s.t.            J v = alpha V,   0 <= alpha <= 1,   lo <= v <= hi   (the velocity box)

    J (m, nv) and V (m,) are the primary task's, in the task frame; v in rad/s; e = q_nom - q the
    error of the problem's posture task, (nv,) (zero where there is none), K its own gain. The rows
    of P are the kernel of J that a full-pivoting LU gives (Eigen's `FullPivLU`, from a J with its
    angular rows first): **not** orthonormal, and dependent on the axes of J. Where rank J = nv
    there is no such term and the program is linear. No direction errors and inside every limit; the
    quadratic term reduces alpha below what the limits allow, the more the larger K. Ignores
    weights.

    Attributes:
        centering: K [1/s]; 0, Drake's default, penalises every null-space velocity; its manual's
            examples use 10.

    Source: [Drake], DoDifferentialInverseKinematics.
    """

    centering: Annotated[float, Range(0.0, unit="1/s"), Drawn(0.0, 10.0)] = 0.0

    program: ClassVar[ProgramKind] = "lp"
    keeps: ClassVar[frozenset[LimitKind]] = frozenset({"position", "velocity", "acceleration"})

    @property
    def sees(self) -> frozenset[ProblemPart]:
        """The posture, where joints are drawn to one."""
        return frozenset({"postures"}) if self.centering else frozenset()

    def velocity(self, problem: DikProblem, solve: Solve) -> Array:
        """See `Formulation`."""
        task = problem.primary
        J, V = task.J, task.V
        m, n = J.shape
        P, q = np.zeros((n + 1, n + 1)), np.zeros(n + 1)
        q[n] = -1.0  # the cost over ALPHA_REWARD: the same program, better scaled
        kernel = lu_kernel(angular_first(J))
        if kernel.size:
            penalty = 2 / ALPHA_REWARD * kernel @ kernel.T
            P[:n, :n] = penalty
            if self.centering:
                q[:n] = -penalty @ (self.centering * posture_of(problem)[1])
        A = np.empty((m, n + 1))
        A[:, :n], A[:, n] = J, -V
        box = problem.box("one-step")
        lower, upper = np.zeros(n + 1), np.ones(n + 1)
        lower[:n], upper[:n] = box.lower, box.upper
        x = solve(QuadraticProgram(P, q, A=A, b=np.zeros(m), lb=lower, ub=upper))
        return x[:n]


def posture_of(problem: DikProblem) -> tuple[Array, Array]:
    """Return V [rad/s] and error q_nom - q [rad] of the first posture task, (nv,), or zeros."""
    for task in problem.tasks:
        if isinstance(task, LinearizedJointTask) and task.error.any():  # not one of damping
            return task.V, task.error
    return np.zeros(problem.robot.nv), np.zeros(problem.robot.nv)


def angular_first(J: Array) -> Array:
    """Put the rows of a pose's Jacobian (6, nv) in Drake's order (angular; linear)."""
    return np.roll(J, 3, axis=0) if len(J) == 6 else J
