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
        targets: where the task frame is to be (`pinocchio.SE3`).
        q: the configuration to start from, then the present one, (nq,).
        iterations: largest number of steps for a target.
        found: the configurations, (nq,) each.
        failure: why there are not as many as targets.
    """

    robot: Robot
    tracking: TrackingTask
    targets: Sequence[Any]
    q: Array
    iterations: int = 200
    found: list[Array] = field(default_factory=list)
    failure: Exception | None = None
    _looks: int = 0
    _residual: float = float("inf")

    def arrives(self, look: _Look) -> tuple[Array, Array] | None:
        """Take in what is seen at the present configuration; None once nothing is left to do.

        Args:
            look: computes error (m,) and Jacobian (m, nv) there, for a target.

        Returns:
            The error and the Jacobian for the next step.
        """
        while len(self.found) < len(self.targets):
            if self._looks == self.iterations:
                raise DikbenchError(
                    f"robot {self.robot.name}: no posture found for the placement, residual "
                    f"{self._residual:.2g}"
                )
            error, J = look(self.targets[len(self.found)], new=self._looks == 0)
            before, self._residual = self._residual, sqrt(error.dot(error))
            self._looks += 1
            there = self._residual < THERE
            if not (there or (self._residual < SMALLEST_RESIDUAL and self._residual >= before)):
                return error, J
            self.found.append(self.q)
            self._looks, self._residual = 0, float("inf")
        return None

    @property
    def is_ours(self) -> bool:
        """Whether the task is one of dikbench's on a frame, and not a plug-in's own."""
        return type(self.tracking) in OURS

    @property
    def residual(self) -> float:
        """Norm of the error (m, rad) where it was last looked at."""
        return self._residual

    def configurations(self) -> Array:
        """Return what was found, (k, nq).

        Raises:
            DikbenchError: if the residual of a target does not fall below 1e-9.
        """
        if self.failure is not None:
            raise self.failure
        return np.array(self.found)


_Look = Callable[..., tuple[Array, Array]]


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


def _pursue_alike(waiting: list[Pursuit]) -> None:
    """Do pursuits of one kind: damped Gauss-Newton steps for all of them together."""
    robot = waiting[0].robot
    kinematics = Kinematics(robot)
    looks = {id(each): _look(each, kinematics) for each in waiting}
    while waiting:
        moving, errors, jacobians = [], [], []
        for each in waiting:
            try:
                kinematics.update(each.q)
                seen = each.arrives(looks[id(each)])
            except Exception as failure:
                each.failure = failure
                continue
            if seen is not None:
                moving.append(each)
                errors.append(seen[0])
                jacobians.append(seen[1])
        waiting = moving
        if waiting:
            residuals = np.array([each.residual for each in waiting])
            steps = _steps(np.array(jacobians), np.array(errors), residuals, robot.joint_scale)
            there = moved(robot, np.array([each.q for each in waiting]), steps)
            for each, q in zip(waiting, there, strict=True):
                each.q = q


def _look(pursuit: Pursuit, kinematics: Kinematics) -> _Look:
    """Make what computes error and Jacobian of the task for a target, at `kinematics`.

    The task itself looks at a new target, and checks it.
    """
    robot, tracking = pursuit.robot, pursuit.tracking
    plain = type(tracking) is PoseTask and tracking.frame in (None, robot.frame)
    whole = robot.task_rows == ALL_ROWS
    plain = plain and robot.task_axes == "body" and (whole or robot.task_rows == PLANE_ROWS)
    rows, frame = np.array(robot.task_rows), robot.frame_id

    def look(target: Any, *, new: bool) -> tuple[Array, Array]:
        if new or not plain:
            task = tracking.linearize(kinematics, target)
            return task.error, task.J
        error = pin.log6(kinematics.placement(frame).actInv(target)).np
        J = kinematics.jacobian(frame)
        return (error, J) if whole else (error[rows], J[rows])

    return look


def _steps(J: Array, error: Array, residual: Array, scale: Array) -> Array:
    """Compute the steps (n, nv) of n pursuits.

    They are Levenberg-Marquardt steps A^T (A A^T + mu I)^-1 e, A = J scale, with damping mu by the
    squared error (Sugihara 2011).

    Args:
        J: Jacobians of the task, (n, m, nv).
        error: e, (n, m).
        residual: its norms, (n,).
        scale: displacement of each joint that counts like a radian, (nv,).
    """
    A = J * scale
    M = A @ A.mT
    M.reshape(len(M), -1)[:, :: M.shape[1] + 1] += (0.1 * residual**2 + 1e-12)[:, None]
    y = np.linalg.solve(M, error[..., None])
    steps: Array = scale * (y.mT @ A)[:, 0]
    if not (np.abs(steps).max() <= LONGEST_STEP):
        largest = np.maximum(np.abs(steps).max(axis=1), 1e-300)
        steps *= np.minimum(1.0, LONGEST_STEP / largest)[:, None]
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
    return pursuit.configurations()
