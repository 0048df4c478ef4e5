"""Reference motions: the desired placement of the task frame at every nominal time."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
import pinocchio as pin

from dikbench.arrays import Array
from dikbench.robots.kinematics import Kinematics
from dikbench.robots.robot import Robot


@dataclass(frozen=True, eq=False)
class Reference:
    """A path of the task frame, parametrised by nominal time tau in [0, duration] [s].

    A time-indexed run has tau = t; in a path-indexed one tau waits for the robot.

    Attributes:
        duration: nominal time from end to end [s]; a target at rest has no path and is held until
            the end of the scenario.
        placement: tau -> placement X_d in the world (`pinocchio.SE3`).
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


def target_at_rest(target: Any, duration: float) -> Reference:
    """Build a reference that rests at a placement from the first instant on (a step)."""
    zero = np.zeros(6)
    return Reference(duration, lambda tau: target, lambda tau: zero, moving=False)


def screw_path(middle: Any, twist: Array, duration: float) -> Reference:
    """Build a constant body twist (6,) that passes `middle` at half the duration.

    X_d(tau) = middle exp6((tau - duration/2) twist).
    """

    def placement(tau: float) -> Any:
        return middle * pin.exp6(pin.Motion((tau - duration / 2) * twist))

    return Reference(duration, placement, lambda tau: twist)


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

    return Reference(duration, placement, twist)
