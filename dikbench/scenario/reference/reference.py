"""Reference motions: the desired placement of the task frame at every nominal time."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable
from dataclasses import dataclass
from typing import Any

import numpy as np
import pinocchio as pin

from dikbench.arrays import Array
from dikbench.problem.tasks.task import ROTATION_ROUNDING, check_rotation
from dikbench.robots.kinematics import Kinematics, placements
from dikbench.robots.robot import Robot
from dikbench.scenario.reference.screws import composed, exp6

Placed = tuple[Array, Array]
"""Rotations (n, 3, 3) and translations (n, 3) [m]."""


@dataclass(frozen=True, eq=False)
class Placement:
    """A placement at every nominal time, which is quicker to compute for many times at once.

    Attributes:
        one: tau [s] -> placement (`pinocchio.SE3`).
        many: times (n,) [s] -> rotations (n, 3, 3) and translations (n, 3) [m], to rounding those
            of `one`.
    """

    one: Callable[[float], Any]
    many: Callable[[Array], Placed]

    def __call__(self, tau: float) -> Any:
        """Compute the placement at a nominal time [s]."""
        return self.one(tau)


@dataclass(frozen=True, eq=False)
class Reference:
    """A path of the task frame, parametrised by nominal time tau in [0, duration] [s].

    A time-indexed run has tau = t; in a path-indexed one tau waits for the robot.

    Attributes:
        duration: nominal time from end to end [s]; a target at rest has no path and is held until
            the end of the scenario.
        placement: tau -> placement X_d in the world (`pinocchio.SE3`); a `Placement` where many
            times at once are quicker.
        velocity: tau -> body twist V_d at nominal speed, (6,) [m/s; rad/s], in the axes of X_d.
        moving: whether there is a path at all.
        period: nominal time of a lap, after which the motion repeats [s]; infinite if it does not.
        first_lap: nominal time at which the first lap begins [s].
    """

    duration: float
    placement: Callable[[float], Any]
    velocity: Callable[[float], Array]
    moving: bool = True
    period: float = math.inf
    first_lap: float = 0.0

    def placements(self, times: Array) -> Placed:
        """Compute rotations (n, 3, 3) and translations (n, 3) [m] at nominal times (n,) [s]."""
        if isinstance(self.placement, Placement):
            return self.placement.many(times)
        placed = [self.placement(tau) for tau in times.tolist()]
        rotations = np.array([X.rotation for X in placed]).reshape(-1, 3, 3)
        return rotations, np.array([X.translation for X in placed]).reshape(-1, 3)

    def targets(self, times: Array) -> Iterable[Any]:
        """Compute the placements (`pinocchio.SE3`) at nominal times (n,) [s], to be read once.

        Raises:
            DikbenchError: if one has no rotation.
        """
        if not isinstance(self.placement, Placement):
            placed = [self.placement(tau) for tau in times.tolist()]
            for X in placed:
                check_rotation("reference", X.rotation)
            return placed
        R, p = self.placement.many(times)
        off = np.abs(R.mT @ R - np.eye(3)).sum(axis=(1, 2)) + np.abs(np.linalg.det(R) - 1)
        for k in np.flatnonzero(~(off < ROTATION_ROUNDING / 4)):
            check_rotation("reference", R[k])
        return map(pin.SE3, R, p)


def target_at_rest(target: Any, duration: float) -> Reference:
    """Build a reference that rests at a placement from the first instant on (a step)."""
    zero = np.zeros(6)
    return Reference(duration, lambda tau: target, lambda tau: zero, moving=False)


def along_screw(
    start: Any,
    twist: Array,
    share: Callable[[Any], Any],
    rate: Callable[[float], float],
    duration: float,
) -> Reference:
    """Build a motion along one screw, X_d(tau) = start exp6(share(tau) twist).

    Args:
        start: placement where the share is 0 (`pinocchio.SE3`).
        twist: body twist, (6,).
        share: of the twist, at a time or at each of an array of times [s].
        rate: its derivative at a time [1/s].
        duration: [s].
    """

    def placement(tau: float) -> Any:
        return start * pin.exp6(pin.Motion(share(tau) * twist))

    def many(times: Array) -> Placed:
        moved = exp6(share(times)[:, None] * twist)
        return composed(start.rotation, start.translation, moved)

    return Reference(duration, Placement(placement, many), lambda tau: rate(tau) * twist)


def screw_path(middle: Any, twist: Array, duration: float) -> Reference:
    """Build a constant body twist (6,) that passes `middle` at half the duration.

    X_d(tau) = middle exp6((tau - duration/2) twist).
    """
    return along_screw(middle, twist, lambda tau: tau - duration / 2, lambda tau: 1.0, duration)


def joint_path(
    robot: Robot,
    configuration: Callable[[float], Array],
    velocity: Callable[[float], Array],
    duration: float,
) -> Reference:
    """Build the task frame's motion along a joint motion tau -> q (nq,), tau -> dq/dtau (nv,)."""
    kinematics = Kinematics(robot)

    def placement(tau: float) -> Any:
        kinematics.update(configuration(tau))
        return kinematics.placement(robot.frame_id).copy()

    def twist(tau: float) -> Array:
        kinematics.update(configuration(tau))
        V: Array = kinematics.jacobian(robot.frame_id) @ velocity(tau)
        return V

    def many(times: Array) -> Placed:
        q = np.array([configuration(tau) for tau in times.tolist()]).reshape(-1, robot.nq)
        placed = placements(robot, robot.frame_id, q)
        return placed[:, :3, :3], placed[:, :3, 3]

    return Reference(duration, Placement(placement, many), twist)
