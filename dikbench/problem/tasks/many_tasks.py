"""Tasks at many configurations at once: the same as `linearize` of each, but for rounding."""

from __future__ import annotations

from collections.abc import Hashable
from typing import Any, NamedTuple

import numpy as np
import pinocchio as pin

from dikbench.arrays import Array
from dikbench.linear_algebra import scaled_identity
from dikbench.problem.tasks.damping import DampingTask
from dikbench.problem.tasks.orientation import LinearizedOrientation, OrientationTask
from dikbench.problem.tasks.pose import (
    LinearizedParts,
    LinearizedPose,
    PoseTask,
    goes_along_screw,
    is_whole,
)
from dikbench.problem.tasks.position import PositionTask
from dikbench.problem.tasks.posture import PostureTask
from dikbench.problem.tasks.task import (
    FrameTask,
    LinearizedJointTask,
    LinearizedTask,
    Task,
    TrackingTask,
)
from dikbench.robots.many_kinematics import ManyKinematics
from dikbench.robots.robot import Robot
from dikbench.robots.task_rows import ALL_ROWS

SERIES_ANGLE = 1e-2
"""Below this angle [rad] quotients of its functions are computed by series."""

HALF_TURN_COSINE = -0.99
"""Rotations with a smaller cosine are left to Pinocchio: their axis is not that of R - R^T."""


class ManyTargets(NamedTuple):
    """Placements and body twists of N targets.

    Attributes:
        rotations: (N, 3, 3).
        translations: (N, 3) [m].
        twists: (N, 6) [m/s; rad/s], in the axes of the targets.
    """

    rotations: Array
    translations: Array
    twists: Array


def kind_of_tracking(task: TrackingTask, robot: Robot) -> Hashable | None:
    """Return what tracking tasks must share to be linearised together; None where they cannot."""
    if type(task) not in (PoseTask, PositionTask, OrientationTask):
        return None
    assert isinstance(task, FrameTask)
    if task.frame is not None or np.ndim(task.weight) or _asks_for_few_turns(task, robot):
        return None
    convention = task.convention if isinstance(task, PoseTask) else None
    shared = task.gain, task.weight, task.priority, convention
    return type(task), *shared, robot.task_rows, robot.task_axes


def _asks_for_few_turns(task: Any, robot: Robot) -> bool:
    """Whether one or two of three angular rows are asked for, whose errors are special."""
    if not isinstance(task, PoseTask) or goes_along_screw(task, robot):
        return False
    return 0 < sum(row >= 3 for row in robot.task_rows) < 3


def kind_of_task(task: Task) -> Hashable | None:
    """Return what other tasks must share to be linearised together; None where they cannot."""
    if isinstance(task, PostureTask | DampingTask) and not np.ndim(task.weight):
        return type(task), getattr(task, "gain", None), task.weight, task.priority
    return None


def linearize_tracking(
    task: Any, robot: Robot, kinematics: ManyKinematics, targets: ManyTargets
) -> LinearizedTask:
    """Linearise a tracking task that `kind_of_tracking` knows, for N targets.

    Returns:
        J (N, m, nv), V and error (N, m).
    """
    R, J = kinematics.rotations, kinematics.jacobians
    relative = product3(R.transpose(0, 2, 1), targets.rotations)
    away = turned(R.transpose(0, 2, 1), targets.translations - kinematics.translations)
    linear = turned(relative, targets.twists[:, :3])
    angular = turned(relative, targets.twists[:, 3:])
    if isinstance(task, PoseTask) and goes_along_screw(task, robot):
        error = logarithms(relative, away)
        V = np.concatenate([linear + crossed(away, angular), angular], axis=1)
        rows = slice(None) if robot.task_rows == ALL_ROWS else np.array(robot.task_rows)
    else:
        turn = rotation_vectors(relative) if _turns(task, robot) else np.zeros_like(away)
        error = np.concatenate([away, turn], axis=1)
        V = np.concatenate([linear, angular], axis=1)
        rows = np.array(task.rows(robot))
        if robot.task_axes == "world":
            error, V = (
                np.concatenate([turned(R, x[:, :3]), turned(R, x[:, 3:])], axis=1)
                for x in (error, V)
            )
            J = np.concatenate([product3(R, J[:, :3]), product3(R, J[:, 3:])], axis=1)
    error, V, J = error[:, rows], V[:, rows], J[:, rows]
    kind = LinearizedTask if isinstance(task, PositionTask) else LinearizedTurns
    return kind(J, task.gain * error + V, error, task.weight, task.priority)


class LinearizedTurns(LinearizedTask, eq=False):
    """Tasks on orientations at many configurations."""

    @property
    def log_derivative(self) -> Array | None:
        """Refuse: it is computed for one placement, so that each row has to be asked alone."""
        raise NotImplementedError("the derivative of the logarithm is not computed for many")


def _turns(task: Any, robot: Robot) -> bool:
    return any(row >= 3 for row in task.rows(robot))


def linearize_task(task: Any, robot: Robot, q: Array, postures: Array) -> LinearizedTask:
    """Linearise another task that `kind_of_task` knows at N configurations.

    Args:
        task: one of them, but for its target.
        robot: the robot.
        q: configurations, (N, nq).
        postures: the targets of posture tasks, (N, nq).
    """
    identity = scaled_identity(robot.nv, 1.0)
    if isinstance(task, DampingTask):
        zero = np.zeros((len(q), robot.nv))
        return LinearizedJointTask(identity, zero, zero, task.weight, task.priority)
    error = differences(robot, q, postures)
    return LinearizedJointTask(identity, task.gain * error, error, task.weight, task.priority)


def row_of(many: LinearizedTask, k: int, task: Any, robot: Robot, relative: Any) -> LinearizedTask:
    """Return row k of what is linearised together, as `linearize` of the task gives it.

    Args:
        many: the rows.
        k: which one.
        task: the task.
        robot: the robot.
        relative: placement of the target seen from the task frame (`pinocchio.SE3`).
    """
    J = many.J if many.J.ndim == 2 else many.J[k]
    parts = (J, many.V[k], many.error[k], many.weight, many.priority)
    if isinstance(many, LinearizedJointTask):
        return LinearizedJointTask(*parts)
    if isinstance(task, PoseTask) and goes_along_screw(task, robot):
        rows = None if robot.task_rows == ALL_ROWS else np.array(robot.task_rows)
        return LinearizedPose(*parts, relative, rows)
    if isinstance(task, PoseTask) and is_whole(robot):
        return LinearizedParts(*parts, relative.rotation)
    if isinstance(task, OrientationTask):
        Q = relative.rotation
        return LinearizedOrientation(*parts, Q, np.array(task.rows(robot)) - 3)
    return LinearizedTask(*parts)


def differences(robot: Robot, q: Array, targets: Array) -> Array:
    """Compute the tangent vectors (N, nv) that lead from q (N, nq) to targets (N, nq)."""
    if robot.nq == robot.nv:
        return targets - q
    model = robot.model
    return np.array([pin.difference(model, a, b) for a, b in zip(q, targets, strict=True)])


def product3(A: Array, B: Array) -> Array:
    """Compute the products of matrices (N, 3, 3) and (N, 3, n), in a fixed order of operations."""
    total: Array = A[:, :, :1] * B[:, :1] + A[:, :, 1:2] * B[:, 1:2]
    return total + A[:, :, 2:] * B[:, 2:]


def turned(R: Array, x: Array) -> Array:
    """Turn vectors (N, 3) by rotations (N, 3, 3)."""
    total: Array = R[:, :, 0] * x[:, :1] + R[:, :, 1] * x[:, 1:2]
    return total + R[:, :, 2] * x[:, 2:]


def crossed(a: Array, b: Array) -> Array:
    """Compute the cross products of vectors (N, 3)."""
    product = np.empty_like(a)
    for k in range(3):
        i, j = (k + 1) % 3, (k + 2) % 3
        product[:, k] = a[:, i] * b[:, j] - a[:, j] * b[:, i]
    return product


def rotation_vectors(R: Array) -> Array:
    """Compute log3 of rotations (N, 3, 3), (N, 3) [rad]."""
    half = np.stack(
        [R[:, 2, 1] - R[:, 1, 2], R[:, 0, 2] - R[:, 2, 0], R[:, 1, 0] - R[:, 0, 1]], axis=1
    )
    half *= 0.5
    sine = np.sqrt(half[:, 0] ** 2 + half[:, 1] ** 2 + half[:, 2] ** 2)
    cosine = 0.5 * (R[:, 0, 0] + R[:, 1, 1] + R[:, 2, 2] - 1)
    angle = np.arctan2(sine, cosine)
    small = sine < SERIES_ANGLE
    # angle / sine = 1 + x^2/6 + 3 x^4/40 + 15 x^6/336 of x = sine, where the angle is small too.
    x2 = sine * sine
    series = 1 + x2 * (1 / 6 + x2 * (3 / 40 + x2 * (15 / 336)))
    factor = np.where(small, series, angle / np.where(small, 1.0, sine))
    vectors: Array = factor[:, None] * half
    for k in np.flatnonzero(cosine < HALF_TURN_COSINE).tolist():
        vectors[k] = pin.log3(R[k])
    return vectors


def logarithms(R: Array, p: Array) -> Array:
    """Compute log6 of placements, rotations (N, 3, 3) and origins (N, 3), (N, 6).

        w = log3(R),   v = a p - w x p / 2 + b (w.p) w
        a = (x/2) / tan(x/2),   b = (1 - a) / x^2,   x = |w|

    Both quotients are computed by series where x is small.
    """
    w = rotation_vectors(R)
    square = w[:, 0] ** 2 + w[:, 1] ** 2 + w[:, 2] ** 2
    x = np.sqrt(square)
    small = x < SERIES_ANGLE
    half = np.where(small, 1.0, x / 2)
    # x sin(x) / (2 (1 - cos(x))) = (x/2) / tan(x/2)
    a = np.where(
        small, 1 - square * (1 / 12 + square * (1 / 720 + square / 30240)), half / np.tan(half)
    )
    b = np.where(
        small,
        1 / 12 + square * (1 / 720 + square / 30240),
        (1 - a) / np.where(small, 1.0, square),
    )
    along = w[:, 0] * p[:, 0] + w[:, 1] * p[:, 1] + w[:, 2] * p[:, 2]
    v = a[:, None] * p - 0.5 * crossed(w, p) + (b * along)[:, None] * w
    return np.concatenate([v, w], axis=1)
