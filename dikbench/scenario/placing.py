"""Configurations that do a tracking task at one target after another, for many motions at once."""

from __future__ import annotations

from collections.abc import Callable, Generator, Iterable, Sequence
from contextvars import ContextVar
from dataclasses import dataclass, field
from functools import partial
from math import inf, sqrt
from typing import Any, Final

import numpy as np
import pinocchio as pin

from dikbench.arrays import Array
from dikbench.errors import DikbenchError
from dikbench.problem.tasks import OrientationTask, PoseTask, PositionTask, TrackingTask
from dikbench.problem.tasks.pose import goes_along_screw
from dikbench.robots.kinematics import Kinematics, moved
from dikbench.robots.robot import Robot

THERE: Final = 1e-12
"""A residual (m, rad) below this is none ..."""

SMALLEST_RESIDUAL: Final = 1e-9
"""... and one below this, that a step does not make smaller, is rounding."""

LONGEST_STEP: Final = 0.3
"""Largest displacement of a joint in a step [rad]."""

OURS: Final = (PoseTask, PositionTask, OrientationTask)
"""Tasks that differ in their targets only where model, frame and rows are the same."""


Sight = tuple[Callable[[Any], Array], Callable[[], Array]]
"""At a configuration: target -> error (m,) of a task, and, after that, its Jacobian (m, nv)."""

Seen = tuple[Array, Array, Array, float]
"""A configuration (nq,), error (m,) and Jacobian (m, nv) of a task there, damping of the step."""


@dataclass(eq=False)
class Pursuit:
    """The configurations that do a task at targets in their order, each solved from the last one.

    Attributes:
        robot: the robot.
        tracking: the task.
        targets: where the task frame is to be (`pinocchio.SE3`), read once.
        q0: the configuration to start from, (nq,).
        iterations: largest number of looks at the error for a target.
        found: the configurations, (nq,) each.
        failure: why there are not as many as targets.
    """

    robot: Robot
    tracking: TrackingTask
    targets: Iterable[Any]
    q0: Array
    iterations: int = 200
    found: list[Array] = field(default_factory=list)
    failure: Exception | None = None

    @property
    def is_ours(self) -> bool:
        """Whether the task is one of dikbench's on a frame, and not a plug-in's own."""
        return type(self.tracking) in OURS

    def walk(self, kinematics: Kinematics) -> Generator[Seen, Any, None]:
        """Go from target to target, in steps that are made elsewhere, up to the last or a failure.

        Args:
            kinematics: serves others too between the steps.

        Yields:
            What is seen where a step is needed; the configuration after it, (nq,), is sent.
        """
        try:
            yield from self._walk(kinematics)
        except Exception as failure:
            self.failure = failure

    def _walk(self, kinematics: Kinematics) -> Generator[Seen, Any, None]:
        (error_of, jacobian), q = _sight(self, kinematics), self.q0
        update, found, iterations = kinematics.update, self.found, range(self.iterations)
        update(q)
        for target in self.targets:
            if not found:  # checks the task, and the target
                self.tracking.linearize(kinematics, target)
            residual = inf
            for _ in iterations:
                error = error_of(target)
                before, residual = residual, sqrt(error.dot(error))
                if residual < THERE or (residual < SMALLEST_RESIDUAL and residual >= before):
                    break
                q = yield q, error, jacobian(), 0.1 * residual**2 + 1e-12
                update(q)
            else:
                raise DikbenchError(
                    f"robot {self.robot.name}: no posture found for the placement, residual "
                    f"{residual:.2g}"
                )
            found.append(q)


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
    walks = [each.walk(kinematics) for each in pursuits]
    there: Sequence[Any] = [None] * len(walks)
    while walks:
        seen: list[Seen] = []
        going = []
        for walk, q in zip(walks, there, strict=True):
            try:
                seen.append(walk.throw(q) if isinstance(q, Exception) else walk.send(q))
            except StopIteration:
                continue
            going.append(walk)
        walks, there = going, _stepped(robot, seen) if seen else []


def _sight(pursuit: Pursuit, kinematics: Kinematics) -> Sight:
    """Make what looks at a task, at the configuration of `kinematics`.

    It does what a pose task does, but for the checks at every step.
    """
    robot, tracking, log6 = pursuit.robot, pursuit.tracking, pin.log6
    rows, frame, placement = np.array(robot.task_rows), robot.frame_id, kinematics.placement
    if (
        type(tracking) is not PoseTask
        or tracking.frame not in (None, robot.frame)
        or not goes_along_screw(tracking, robot)
    ):
        return _task_sight(tracking, kinematics)
    if len(rows) == 6:
        return (
            lambda target: log6(placement(frame).actInv(target)).np,
            partial(kinematics.jacobian, frame),
        )
    return (
        lambda target: log6(placement(frame).actInv(target)).np[rows],
        lambda: kinematics.jacobian(frame)[rows],
    )


def _task_sight(tracking: TrackingTask, kinematics: Kinematics) -> Sight:
    """Make what looks at any task."""
    J = np.empty(0)

    def error_of(target: Any) -> Array:
        nonlocal J
        task = tracking.linearize(kinematics, target)
        J = task.J
        return task.error

    return error_of, lambda: J


def _stepped(robot: Robot, seen: list[Seen]) -> list[Array | Exception]:
    """Make a step from each of several configurations, of joints by at most `LONGEST_STEP`.

    It is the Levenberg-Marquardt step A^T (A A^T + mu I)^-1 e, with the task's error e, damping mu
    by the squared error (Sugihara 2011), and A = J scale (see `Robot.joint_scale`).

    Returns:
        The configurations after it, (nq,) each; an error where one is singular to rounding.
    """
    q, error, J, damping = (np.array(each) for each in zip(*seen, strict=True))
    scale = robot.joint_scale
    A = J * scale
    M = A @ A.mT
    M.reshape(len(M), -1)[:, :: M.shape[1] + 1] += damping[:, None]
    try:
        y = np.linalg.solve(M, error[..., None])
    except np.linalg.LinAlgError as failure:  # of one, or of which of them?
        return [failure] if len(M) == 1 else [_stepped(robot, [each])[0] for each in seen]
    steps = scale * (y.mT @ A)[:, 0]
    if not np.vdot(steps, steps) <= LONGEST_STEP**2:
        largest = np.maximum(np.abs(steps).max(axis=1), 1e-300)
        steps *= np.minimum(1.0, LONGEST_STEP / largest)[:, None]
    return list(moved(robot, q, steps))


def _alone(pursuit: Pursuit) -> None:
    pursue([pursuit])


PURSUED_BY: Final[ContextVar[Callable[[Pursuit], None]]] = ContextVar("pursued", default=_alone)
"""Who does a pursuit: by itself, unless something collects those of several scenarios."""


def configurations(
    robot: Robot,
    targets: Iterable[Any],
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
