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

REWARD = 100.0
"""Of alpha, beside a squared null-space velocity."""


@dataclass(frozen=True)
class Drake(Parameters):
    """Alpha scaling as Drake ships it: progress and joint centring weighed in one cost.

        min_(v, alpha)  -100 alpha + ||P (v - K e)||^2
        s.t.            J v = alpha V,   0 <= alpha <= 1,   lo <= v <= hi   (the velocity box)

    J (m, nv) and V (m,) are the primary task's, in the task frame; v in rad/s; e = q_nom - q the
    error of the problem's posture task, (nv,) (zero where there is none), K its own gain. The rows
    of P are the kernel of J that a full-pivoting LU gives (Eigen's `FullPivLU`, from a J with its
    angular rows first): **not** orthonormal, and dependent on the axes of J. There is no such term
    where rank J = nv: the program is then linear. Never off course and inside every limit; the
    quadratic term pulls alpha below what the limits allow, the more the larger K. Weights play no
    part.

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
        q[n] = -1.0  # the whole cost over REWARD: the same program, in a solver's own scale
        kernel = lu_kernel(angular_first(J))
        if kernel.size:
            penalty = 2 / REWARD * kernel @ kernel.T
            P[:n, :n] = penalty
            if self.centering:
                q[:n] = -penalty @ (self.centering * posture_error(problem))
        A = np.empty((m, n + 1))
        A[:, :n], A[:, n] = J, -V
        box = problem.box("one-step")
        lower, upper = np.zeros(n + 1), np.ones(n + 1)
        lower[:n], upper[:n] = box.lower, box.upper
        x = solve(QuadraticProgram(P, q, A=A, b=np.zeros(m), lb=lower, ub=upper))
        return x[:n]


def posture_error(problem: DikProblem) -> Array:
    """q_nom - q of the problem's first posture task, (nv,) [rad]; zero where there is none."""
    for task in problem.tasks:
        if isinstance(task, LinearizedJointTask) and task.error.any():  # not one of damping
            return task.error
    return np.zeros(problem.robot.nv)


def angular_first(J: Array) -> Array:
    """The rows of a pose's Jacobian in Drake's order."""
    return np.roll(J, 3, axis=0) if len(J) == 6 else J
