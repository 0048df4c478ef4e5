"""Alpha scaling by components: x, y, z, roll, pitch and yaw are slowed down separately."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated, ClassVar

import numpy as np
import pinocchio as pin

from dikbench.errors import Infeasible
from dikbench.problem import (
    Array,
    Braking,
    DikProblem,
    Drawn,
    LimitKind,
    LinearizedOrientation,
    Parameters,
    ProgramKind,
    QuadraticProgram,
    Range,
    Solve,
    rank,
    thin_svd,
)
from formulations.lp_alpha import regularization_for

DEPENDENT_SHARE = 1e-12
"""Share of the largest singular value of J up to which one is zero but for rounding."""

SLACK = 1e-6
"""Where J is singular alpha may be negative by this: else its bounds contradict its equations up to
rounding, and solvers that are asked for many digits find nothing."""

SMALLEST_COS_PITCH = 1e-3
"""|cos(pitch)| below which the rates of roll and yaw are not defined."""


@dataclass(frozen=True)
class LpAlphaComponents(Parameters):
    """Component-wise alpha scaling: each world axis as fast as the limits allow.

        max_(v, alpha)  sum_i alpha_i - 1/2 rho ||v||^2
        s.t.            J v = E diag(alpha) E^-1 V,   0 <= alpha_i <= 1,   lo <= v <= hi

    J (m, nv) and V (m,) are the primary task's, in the task frame; v in rad/s; alpha (m,). E (m, m)
    maps the rates of x, y, z, roll, pitch, yaw of the task frame in the world (R = Rz(yaw)
    Ry(pitch) Rx(roll)) to its body twist, so that a teleoperator who meets a limit along one axis
    keeps the others: direction errors are intended, and depend on the axes. lo and hi are the
    velocity box. Where J is singular, alpha_i >= -1e-6. Ignores weights.

    Attributes:
        regularization: rho; None: 1e-4 if the arm has more joints than the task has rows, else 0.
        braking: how the box approaches a position limit (see `dikbench.problem.velocity_box`).

    Raises:
        Infeasible: near cos(pitch) = 0, where E has no inverse (that of a position has one); if
            the task is neither a pose nor a position nor an orientation.

    Source: [Tedrake] (the component-wise relaxation for teleoperation).
    """

    regularization: Annotated[float | None, Range(0.0), Drawn(1e-6, 1e-2, log=True)] = None
    braking: Braking = "viable"

    program: ClassVar[ProgramKind] = "lp"
    keeps: ClassVar[frozenset[LimitKind]] = frozenset({"position", "velocity", "acceleration"})

    def refuses(self, problem: DikProblem) -> str:
        """Whether the first priority is anything but one pose, or a part of one."""
        try:
            _rows(problem, problem.robot.task_rows)
        except Infeasible as error:
            return str(error)
        return ""

    def velocity(self, problem: DikProblem, solve: Solve) -> Array:
        """See `Formulation`."""
        task, robot = problem.primary, problem.robot
        m, n = task.J.shape
        pin.forwardKinematics(robot.model, robot.scratch, problem.q)
        rotation = pin.updateFramePlacement(robot.model, robot.scratch, robot.frame_id).rotation
        rows = _rows(problem, robot.task_rows)
        rates = twist_from_rates(rotation) if rows[-1] >= 3 else rotation.T
        if robot.task_axes == "world":
            rates = np.kron(np.eye(len(rates) // 3), rotation) @ rates
        E = rates[np.ix_(rows, rows)]
        P = np.zeros((n + m, n + m))
        P[:n, :n].flat[:: n + 1] = regularization_for(task, self.regularization)
        q = np.concatenate([np.zeros(n), -np.ones(m)])
        A, kept = _apart(np.hstack([task.J, -E * np.linalg.solve(E, task.V)]), n)
        slack = 0.0 if kept == m else SLACK
        box = problem.box(self.braking)
        lower = np.concatenate([box.lower, np.full(m, -slack)])
        upper = np.concatenate([box.upper, np.ones(m)])
        return solve(QuadraticProgram(P, q, A=A, b=np.zeros(m), lb=lower, ub=upper))[:n]


def _apart(A: Array, n: int) -> tuple[Array, int]:
    """Turn the rows of A (m, n + m) so that a singular J, its first n columns, has rows of zeros.

    The equations A x = 0 stay the same. As they are, rows that depend on each other up to rounding
    make active-set solvers cycle.

    Returns:
        The rows, and the rank of J.
    """
    U, singular, _ = thin_svd(A[:, :n])
    kept = rank(singular, DEPENDENT_SHARE * singular[0])
    if kept == len(A):
        return A, kept
    turned: Array = U.T @ A
    turned[kept:, :n] = 0.0
    return turned, kept


def _rows(problem: DikProblem, rows: tuple[int, ...]) -> list[int]:
    """Return the rows of the twist that the first priority is about.

    Those of a whole pose, a position or an orientation.

    Raises:
        Infeasible: if it is about anything else.
    """
    first = [task for task in problem.tasks if task.priority == problem.tasks[0].priority]
    turns = isinstance(first[0], LinearizedOrientation)
    part = [row for row in rows if (row >= 3) == turns]
    for kept in (list(rows), part):
        if len(first) == 1 and len(kept) == len(first[0].V):
            return kept
    raise Infeasible("components are those of a pose or a part of it, not of several tasks")


def twist_from_rates(rotation: Array) -> Array:
    """Compute E (6, 6): world rates of x, y, z, roll, pitch, yaw to a body twist.

    The body twist is (linear; angular).

    Args:
        rotation: R = Rz(yaw) Ry(pitch) Rx(roll), (3, 3).

    Raises:
        Infeasible: where roll and yaw turn about the same axis.
    """
    pitch = np.arctan2(-rotation[2, 0], np.hypot(rotation[0, 0], rotation[1, 0]))
    if abs(np.cos(pitch)) < SMALLEST_COS_PITCH:
        raise Infeasible("roll, pitch and yaw have no rates near cos(pitch) = 0")
    yaw = np.arctan2(rotation[1, 0], rotation[0, 0])
    c, s, cp, sp = np.cos(yaw), np.sin(yaw), np.cos(pitch), np.sin(pitch)
    axes = np.array([[c * cp, -s, 0.0], [s * cp, c, 0.0], [-sp, 0.0, 1.0]])  # in the world
    E = np.zeros((6, 6))
    E[:3, :3] = rotation.T
    E[3:, 3:] = rotation.T @ axes
    return E
