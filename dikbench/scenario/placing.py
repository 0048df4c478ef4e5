"""Configurations that do a tracking task at one target after another, for many motions at once."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from contextvars import ContextVar
from dataclasses import dataclass, field
from functools import partial
from math import sqrt
from typing import Any, Final

import numpy as np
import pinocchio as pin

from dikbench.arrays import Array
from dikbench.errors import DikbenchError
from dikbench.problem.tasks import OrientationTask, PoseTask, PositionTask, TrackingTask
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

    def look(
        self, error_of: Callable[[Any], Array], jacobian: Callable[[], Array]
    ) -> tuple[Array, Array] | None:
        """Look from the present configuration at targets, up to one that is not reached there.

        Args:
            error_of: the error (m,) of the task there for a target.
            jacobian: of the task there, (m, nv), after its error.

        Returns:
            The error for that target, and the Jacobian; None once all are reached.

        Raises:
            DikbenchError: if there were as many looks as are allowed.
        """
        looks, before = self.looks, self.residual
        while True:
            if looks == self.iterations:
                raise DikbenchError(
                    f"robot {self.robot.name}: no posture found for the placement, residual "
                    f"{before:.2g}"
                )
            error = error_of(self.targets[len(self.found)])
            looks += 1
            residual = sqrt(error.dot(error))
            if not (residual < THERE or (residual < SMALLEST_RESIDUAL and residual >= before)):
                self.looks, self.residual = looks, residual
                return error, jacobian()
            self.found.append(self.q)
            looks, before = 0, float("inf")
            if len(self.found) == len(self.targets):
                return None


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
    robot, kinematics = pursuits[0].robot, Kinematics(pursuits[0].robot)
    scale = None if (robot.joint_scale == 1.0).all() else robot.joint_scale
    if _asks_for_the_pose(pursuits[0]):
        error_of, jacobian = _pose_of(kinematics)
        pursuits = [each for each in pursuits if _is_valid(each, kinematics)]
    else:
        error_of, jacobian = _task_of(pursuits[0].tracking, kinematics)
    while pursuits:
        waiting, pursuits, errors, jacobians = pursuits, [], [], []
        for each in waiting:
            try:
                kinematics.update(each.q)
                seen = each.look(error_of, jacobian)
            except Exception as failure:
                each.failure = failure
                continue
            if seen is not None:
                pursuits.append(each)
                errors.append(seen[0])
                jacobians.append(seen[1])
        if pursuits:
            _step(pursuits, np.array(jacobians), np.array(errors), scale)
            pursuits = [each for each in pursuits if each.failure is None]


def _asks_for_the_pose(pursuit: Pursuit) -> bool:
    """Say whether a task's error is the logarithm of a pose, or rows of it."""
    robot, tracking = pursuit.robot, pursuit.tracking
    if type(tracking) is not PoseTask or tracking.frame not in (None, robot.frame):
        return False
    return robot.task_axes == "body" and robot.task_rows in (ALL_ROWS, PLANE_ROWS)


def _is_valid(pursuit: Pursuit, kinematics: Kinematics) -> bool:
    """Let the task itself look at the first target once, and check its own and the target's."""
    try:
        kinematics.update(pursuit.q)
        pursuit.tracking.linearize(kinematics, pursuit.targets[0])
    except Exception as failure:
        pursuit.failure = failure
    return pursuit.failure is None


def _pose_of(kinematics: Kinematics) -> tuple[Callable[[Any], Array], Callable[[], Array]]:
    """Make what computes error and Jacobian of a pose task, without its checks at every step."""
    robot, log6, placement = kinematics.robot, pin.log6, kinematics.placement
    frame, rows = robot.frame_id, np.array(robot.task_rows)
    if robot.task_rows == ALL_ROWS:
        return (
            lambda target: log6(placement(frame).actInv(target)).np,
            partial(kinematics.jacobian, frame),
        )
    return (
        lambda target: log6(placement(frame).actInv(target)).np[rows],
        lambda: kinematics.jacobian(frame)[rows],
    )


def _task_of(
    tracking: TrackingTask, kinematics: Kinematics
) -> tuple[Callable[[Any], Array], Callable[[], Array]]:
    """Make what computes error and Jacobian of any task."""
    seen: list[Array] = []

    def error_of(target: Any) -> Array:
        task = tracking.linearize(kinematics, target)
        seen[:] = [task.J]
        return task.error

    return error_of, lambda: seen[0]


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
