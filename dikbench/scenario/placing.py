"""Configurations that do a tracking task at one target after another, for many motions at once."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from contextvars import ContextVar
from dataclasses import dataclass, field
from math import sqrt
from typing import Any, Final

import numpy as np
import pinocchio as pin

from dikbench.arrays import Array
from dikbench.errors import DikbenchError
from dikbench.problem.tasks import OrientationTask, PoseTask, PositionTask, TrackingTask
from dikbench.problem.tasks.task import check_rotation
from dikbench.robots.kinematics import Kinematics, moved
from dikbench.robots.robot import Robot
from dikbench.robots.task_rows import ALL_ROWS, PLANE_ROWS

THERE: Final = 1e-12
"""A residual (m, rad) below this is none ..."""

SMALLEST_RESIDUAL: Final = 1e-9
"""... and one below this, that a step does not make smaller, is rounding."""

LONGEST_STEP: Final = 0.3
"""Largest displacement of a joint in a step [rad]."""

OURS: Final = (PoseTask, PositionTask, OrientationTask)
"""Tasks that differ in their targets only where model, frame and rows are the same."""


@dataclass(eq=False)
class Pursuit:
    """The configurations that do a task at targets in their order, each solved from the last one.

    Attributes:
        robot: the robot.
        tracking: the task.
        targets: where the task frame is to be (`pinocchio.SE3`), at least one.
        q: the configuration to start from, then the present one, (nq,).
        iterations: largest number of looks at the error for a target.
        found: the configurations, (nq,) each.
        failure: why there are not as many as targets.
        looks: number of looks for the present target.
        residual: norm of the error (m, rad) at the last one.
    """

    robot: Robot
    tracking: TrackingTask
    targets: Sequence[Any]
    q: Array
    iterations: int = 200
    found: list[Array] = field(default_factory=list)
    failure: Exception | None = None
    looks: int = 0
    residual: float = float("inf")

    @property
    def is_ours(self) -> bool:
        """Whether the task is one of dikbench's on a frame, and not a plug-in's own."""
        return type(self.tracking) in OURS

    def look(self, sight: _Sight) -> tuple[Array, Array] | None:
        """Look from the present configuration at targets, up to one that is not reached there.

        Returns:
            Its error (m,) and the Jacobian (m, nv); None once all are reached.

        Raises:
            DikbenchError: if there were as many looks as are allowed.
        """
        before = self.residual
        while True:
            if self.looks == self.iterations:
                raise DikbenchError(
                    f"robot {self.robot.name}: no posture found for the placement, residual "
                    f"{before:.2g}"
                )
            error = sight.error(self, self.targets[len(self.found)])
            self.looks += 1
            residual = sqrt(error.dot(error))
            if not (residual < THERE or (residual < SMALLEST_RESIDUAL and residual >= before)):
                self.residual = residual
                return error, sight.jacobian()
            self.found.append(self.q)
            self.looks, before = 0, float("inf")
            if len(self.found) == len(self.targets):
                return None


class _Sight:
    """What pursuits of one kind see at a configuration: the error of their task, and its Jacobian.

    Attributes:
        kinematics: the robot at the configuration.
    """

    def __init__(self, pursuit: Pursuit) -> None:
        robot, tracking = pursuit.robot, pursuit.tracking
        self.kinematics = Kinematics(robot)
        self._frame = robot.frame_id
        self._rows = None if robot.task_rows == ALL_ROWS else np.array(robot.task_rows)
        # What a pose task does, without what it checks at every step.
        self._plain = (
            type(tracking) is PoseTask
            and tracking.frame in (None, robot.frame)
            and robot.task_axes == "body"
            and robot.task_rows in (ALL_ROWS, PLANE_ROWS)
        )
        self._J: Array | None = None

    def error(self, pursuit: Pursuit, target: Any) -> Array:
        """Compute the error for a target, (m,)."""
        if not self._plain or not (pursuit.looks or pursuit.found):
            task = pursuit.tracking.linearize(self.kinematics, target)
            self._J = task.J
            return task.error
        if not pursuit.looks:
            check_rotation("pose task", target.rotation)
        self._J = None
        error: Array = pin.log6(self.kinematics.placement(self._frame).actInv(target)).np
        return error if self._rows is None else error[self._rows]

    def jacobian(self) -> Array:
        """Compute the Jacobian there, (m, nv)."""
        if self._J is not None:
            return self._J
        J = self.kinematics.jacobian(self._frame)
        return J if self._rows is None else J[self._rows]


def pursue(pursuits: Iterable[Pursuit]) -> None:
    """Do all pursuits, those of one kind in the same steps.

    What is found for one is the same to the bit, whatever is beside it.
    """
    kinds: dict[object, list[Pursuit]] = {}
    for each in pursuits:
        kinds.setdefault(_kind(each), []).append(each)
    for alike in kinds.values():
        _pursue_alike(alike)


def _kind(pursuit: Pursuit) -> object:
    """Return what pursuits must share to be done in the same steps."""
    robot, tracking = pursuit.robot, pursuit.tracking
    if not pursuit.is_ours:
        return id(pursuit)
    own = (robot.frame, robot.task_rows, robot.task_axes, robot.movable_rows)
    scale = robot.joint_scale.tobytes()
    return id(robot.model), own, scale, type(tracking), getattr(tracking, "frame", None)


def _pursue_alike(pursuits: list[Pursuit]) -> None:
    """Do pursuits of one kind: damped Gauss-Newton steps for all of them together."""
    robot, sight, moving = pursuits[0].robot, _Sight(pursuits[0]), pursuits
    scale = None if (robot.joint_scale == 1.0).all() else robot.joint_scale
    while moving:
        waiting, moving, errors, jacobians = moving, [], [], []
        for each in waiting:
            try:
                sight.kinematics.update(each.q)
                seen = each.look(sight)
            except Exception as failure:
                each.failure = failure
                continue
            if seen is not None:
                moving.append(each)
                errors.append(seen[0])
                jacobians.append(seen[1])
        if moving:
            _step(moving, np.array(jacobians), np.array(errors), scale)
            moving = [each for each in moving if each.failure is None]


def _step(pursuits: list[Pursuit], J: Array, error: Array, scale: Array | None) -> None:
    """Make a step of all pursuits, of joints by at most `LONGEST_STEP`.

    Args:
        pursuits: n of them, of one kind.
        J: Jacobians of the task, (n, m, nv).
        error: (n, m).
        scale: displacement of each joint that counts like a radian, (nv,); None: 1.
    """
    damping = np.array([0.1 * each.residual**2 + 1e-12 for each in pursuits])
    try:
        steps = _damped(J if scale is None else J * scale, error, damping)
    except np.linalg.LinAlgError as failure:  # one is singular to rounding: which?
        if len(pursuits) == 1:
            pursuits[0].failure = failure
            return
        for k, each in enumerate(pursuits):
            _step([each], J[k : k + 1], error[k : k + 1], scale)
        return
    if scale is not None:
        steps *= scale
    if not np.vdot(steps, steps) <= LONGEST_STEP**2:
        largest = np.maximum(np.abs(steps).max(axis=1), 1e-300)
        steps *= np.minimum(1.0, LONGEST_STEP / largest)[:, None]
    there = moved(pursuits[0].robot, np.array([each.q for each in pursuits]), steps)
    for each, q in zip(pursuits, there, strict=True):
        each.q = q


def _damped(A: Array, error: Array, damping: Array) -> Array:
    """Compute Levenberg-Marquardt steps A^T (A A^T + mu I)^-1 e of n pursuits, (n, nv).

    Args:
        A: Jacobians of the task, (n, m, nv).
        error: e, (n, m).
        damping: mu, (n,).
    """
    M = A @ A.mT
    M.reshape(len(M), -1)[:, :: M.shape[1] + 1] += damping[:, None]
    y = np.linalg.solve(M, error[..., None])
    steps: Array = (y.mT @ A)[:, 0]
    return steps


def _alone(pursuit: Pursuit) -> None:
    pursue([pursuit])


PURSUED_BY: Final[ContextVar[Callable[[Pursuit], None]]] = ContextVar("pursued", default=_alone)
"""Who does a pursuit: by itself, unless something collects those of several scenarios."""


def configurations(
    robot: Robot,
    targets: Sequence[Any],
    q0: Array,
    tracking: TrackingTask,
    iterations: int = 200,
) -> Array:
    """Solve targets one after another, each from the one before, the first from q0; (k, nq).

    Raises:
        DikbenchError: if the residual of a target does not fall below 1e-9.
    """
    pursuit = Pursuit(robot, tracking, targets, q0, iterations)
    PURSUED_BY.get()(pursuit)
    if pursuit.failure is not None:
        raise pursuit.failure
    found: Array = np.array(pursuit.found)
    return found
