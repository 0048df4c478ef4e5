"""What the families share: checked parameters, limits in force, the start of a run."""

from __future__ import annotations

import numpy as np
import pinocchio as pin

from dikbench.array import Array
from dikbench.errors import DikbenchError
from dikbench.kinematics import Kinematics
from dikbench.references import Reference
from dikbench.robot import Robot
from dikbench.tasks import PostureTask, Task

POSTURE_WEIGHT = 1e-4
"""Weight of the secondary posture task: strong enough to choose a posture in the null space, weak
enough not to be seen in the pose."""


def positive(family: str, **values: float) -> None:
    """Check that parameters are positive and finite.

    Raises:
        DikbenchError: naming the first that is not.
    """
    for name, value in values.items():
        if not 0 < value < float("inf"):
            raise DikbenchError(f"scenario {family}: {name}={value} must be positive and finite")


def between(family: str, name: str, value: float, low: float, high: float) -> None:
    """Check that a parameter lies in a range.

    Raises:
        DikbenchError: if it does not.
    """
    if not low <= value <= high:
        raise DikbenchError(f"scenario {family}: {name}={value} must be between {low} and {high}")


def limits_in_force(robot: Robot, *, acceleration: bool) -> Robot:
    """The robot with its acceleration limits in force, or without.

    Raises:
        DikbenchError: if they are wanted and none are known for this robot.
    """
    if not acceleration:
        return robot.with_limits(acceleration=None)
    if robot.available_acceleration is None:
        raise DikbenchError(f"robot {robot.name}: no acceleration limits are known")
    return robot.with_limits(acceleration=robot.available_acceleration)


def secondary_tasks(robot: Robot, posture: Array) -> tuple[Task, ...]:
    """Hold a posture in the null space, where the arm has one."""
    if robot.nv <= len(robot.task_rows):
        return ()
    return (PostureTask(target=posture, gain=1.0, weight=POSTURE_WEIGHT),)


def start_velocity(robot: Robot, reference: Reference, q0: Array) -> Array:
    """The joint velocity (nv,) that follows the reference at its beginning, inside the limits."""
    kinematics = Kinematics(robot)
    kinematics.update(q0)
    rows = np.array(robot.task_rows)
    J = kinematics.jacobian(robot.frame_id)[rows]
    v: Array = np.linalg.pinv(J, rcond=1e-6) @ reference.velocity(0.0)[rows]
    limit = robot.limits.velocity
    if limit is None:
        return v
    return v / max(1.0, float(limit.usage(v).max()))


def placement_of(robot: Robot, q: Array) -> pin.SE3:
    """Placement of the task frame at a configuration (nq,)."""
    kinematics = Kinematics(robot)
    kinematics.update(q)
    return kinematics.placement(robot.frame_id).copy()


def perturbed(robot: Robot, q: Array, seed: int, spread: float, fixed: tuple[int, ...]) -> Array:
    """A configuration moved by up to `spread` [rad] per joint; seed 0 moves nothing.

    Args:
        robot: the robot.
        q: the configuration, (nq,).
        seed: of the random generator.
        spread: half width of the uniform perturbation [rad].
        fixed: joints (indices into v) that stay.

    Raises:
        DikbenchError: on a negative seed.
    """
    if seed < 0:
        raise DikbenchError(f"seed {seed} must not be negative")
    if seed == 0:
        return q
    step = np.random.default_rng(seed).uniform(-spread, spread, robot.nv)
    step[list(fixed)] = 0.0
    moved: Array = pin.integrate(robot.model, q, step)
    return moved
