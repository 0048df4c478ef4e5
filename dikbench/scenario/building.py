"""What the families share: checked parameters, limits in force, the start of a run."""

from __future__ import annotations

import numpy as np
import pinocchio as pin

from dikbench.arrays import Array
from dikbench.errors import DikbenchError
from dikbench.linear_algebra import pseudo_inverse
from dikbench.problem.tasks import PostureTask, Task, TrackingTask
from dikbench.robots.kinematics import Kinematics
from dikbench.robots.robot import Robot
from dikbench.scenario.oracle import POSE, oracle_motion
from dikbench.scenario.reference.reference import Reference
from dikbench.scenario.steps import steps_in

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


def influence_distance(*, acceleration: bool) -> float:
    """Distance [m] from which a collision is looked out for: farther where joints brake slowly."""
    return 0.5 if acceleration else 0.1


def secondary_tasks(
    robot: Robot, posture: Array, tracking: TrackingTask = POSE
) -> tuple[Task, ...]:
    """Hold a posture in the null space, where the arm has one."""
    if robot.nv <= len(tracking.rows(robot)):
        return ()
    return (PostureTask(target=posture, gain=1.0, weight=POSTURE_WEIGHT),)


def start_velocity(
    robot: Robot, reference: Reference, q0: Array, tracking: TrackingTask = POSE
) -> Array:
    """The joint velocity (nv,) that follows the reference at its beginning, inside the limits."""
    kinematics = Kinematics(robot)
    kinematics.update(q0)
    twist = pin.Motion(reference.velocity(0.0))
    # Only the reference's own velocity: where the start is off the path, the error is not.
    still = tracking.linearize(kinematics, reference.placement(0.0))
    moving = tracking.linearize(kinematics, reference.placement(0.0), twist)
    v: Array = np.linalg.pinv(moving.J, rcond=1e-6) @ (moving.V - still.V)
    limit = robot.limits.velocity
    if limit is None:
        return v
    return v / max(1.0, float(limit.usage(v).max()))


def placement_of(robot: Robot, q: Array) -> pin.SE3:
    """Placement of the task frame at a configuration (nq,)."""
    kinematics = Kinematics(robot)
    kinematics.update(q)
    return kinematics.placement(robot.frame_id).copy()


def duration_at(robot: Robot, at_one_second: Reference, q0: Array, speed: float) -> float:
    """How long a motion takes [s] whose exact joint motion peaks at `speed` times the limits.

    Args:
        robot: the robot, with velocity limits in force.
        at_one_second: the motion, done in one second: joint speeds go with 1/duration.
        q0: configuration at its beginning, (nq,).
        speed: peak of the joint speeds over their limits.
    """
    motion = oracle_motion(robot, at_one_second, q0, np.linspace(0.0, 1.0, 201))
    return motion.peak_speed_ratio / speed


def least_norm_share(robot: Robot, q: Array, joint: int, tracking: TrackingTask = POSE) -> float:
    """The smallest share of a joint in the least-norm velocity that does what it does alone.

    The entry (joint, joint) of J^+ J, at configurations q (k, nq): 1 where no other velocity does
    it, less where the arm's null space has a part of it.
    """
    kinematics, rows, shares = Kinematics(robot), np.array(tracking.rows(robot)), []
    for sample in q:
        kinematics.update(sample)
        J = kinematics.jacobian(robot.frame_id)[rows]
        shares.append(pseudo_inverse(J, 1e-6)[joint] @ J[:, joint])
    return float(min(shares))


def samples(duration: float, dt: float, most: int = 200) -> Array:
    """Instants (k + 1,) [s] from end to end at which a certificate is measured.

    Every control step, or `most` of them where there are more.
    """
    return np.linspace(0.0, duration, min(most, max(2, steps_in(duration, dt))) + 1)
