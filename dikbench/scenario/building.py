"""Parts of families: limits in force, the start of a run, motions, usual claims.

Placements are `pinocchio.SE3`, configurations (nq,), joint velocities (nv,) [rad/s or m/s], times
in seconds; a configuration that depends on time is a function tau [s] -> q.
"""

from __future__ import annotations

from collections.abc import Callable
from math import pi

import numpy as np
import pinocchio as pin

from dikbench.arrays import Array
from dikbench.errors import DikbenchError
from dikbench.linear_algebra import pseudo_inverse
from dikbench.problem.tasks import PostureTask, Task, TrackingTask
from dikbench.robots.kinematics import Kinematics
from dikbench.robots.robot import Robot
from dikbench.robots.task_rows import ALL_ROWS, rows_in_words
from dikbench.scenario.certificate import Claim
from dikbench.scenario.oracle import POSE, OracleMotion, measure_motion, oracle_motion
from dikbench.scenario.reference.reference import Reference, along_screw
from dikbench.scenario.steps import steps_in

DEPENDENT = 1e-6
"""Singular values (m, rad) below this are of rows that depend on each other."""

JointMotion = tuple[Callable[[float], Array], Callable[[float], Array]]
"""tau [s] -> configuration (nq,), and tau -> its derivative (nv,) [rad/s or m/s]."""

POSTURE_WEIGHT = 1e-4
"""Weight of the secondary posture task: large enough to choose a posture in the null space, too
small to affect the pose visibly."""

LEAST_PERIODS = 20
"""Smallest number of control periods in a motion."""

LEAST_PEAK = 0.95
"""Smallest share of a motion's peak speed that its samples at the control steps must see."""


def limits_in_force(robot: Robot, *, acceleration: bool) -> Robot:
    """Return the robot with its acceleration limits in force, or without.

    Raises:
        DikbenchError: if `acceleration` is set and none are known for this robot.
    """
    if not acceleration:
        in_force = robot.limits.acceleration is not None
        return robot.with_limits(acceleration=None) if in_force else robot
    if robot.available_acceleration is None:
        raise DikbenchError(
            f"robot {robot.name}: no acceleration limits are known; valid: acceleration=false, or "
            "numbers [rad/s^2], such as acceleration=10"
        )
    return robot.with_limits(acceleration=robot.available_acceleration)


def acceleration_asked(value: bool | float | str) -> tuple[bool, float | str | None]:
    """Read a family's `acceleration`: whether limits are in force, and which if given by hand."""
    word = str(value).strip().lower()
    if word in ("true", "false"):
        return word == "true", None
    return True, value


def check_rows(robot: Robot) -> None:
    """Check that a robot has as many joints as it is asked for rows, and moves them independently.

    Raises:
        DikbenchError: if it does not at its start, which of a URDF is the best of many postures.
    """
    rows = rows_in_words(robot.task_rows, robot.task_axes)
    if len(robot.chain) < len(robot.task_rows):
        wanted = "a pose" if robot.task_rows == ALL_ROWS else f"rows={rows}"
        raise DikbenchError(
            f"frame {robot.frame} is moved by {len(robot.chain)} joints, {wanted} has "
            f"{len(robot.task_rows)} rows: give rows=..., at most as many as joints, such as "
            "rows=xyz for the position alone"
        )
    kinematics = Kinematics(robot)
    kinematics.update(robot.q0)
    J = kinematics.task_jacobian()
    rank = int(np.linalg.matrix_rank(J, tol=DEPENDENT))
    if rank < len(J):
        raise DikbenchError(
            f"of the {len(J)} rows {rows} of frame {robot.frame} its {len(robot.chain)} joints "
            f"move {rank} independently; give other rows=..., at most {rank}"
        )


def influence_distance(robot: Robot) -> float:
    """Return the distance [m] below which a collision pair has a row."""
    return 0.1 if robot.limits.acceleration is None else 0.5


def secondary_tasks(
    robot: Robot, posture: Array, tracking: TrackingTask = POSE
) -> tuple[Task, ...]:
    """Hold a posture in the null space, where the arm has one."""
    if len(robot.chain) <= len(tracking.rows(robot)):
        return ()
    return (PostureTask(target=posture, gain=1.0, weight=POSTURE_WEIGHT),)


def start_velocity(
    robot: Robot, reference: Reference, q0: Array, tracking: TrackingTask = POSE
) -> Array:
    """Compute the joint velocity (nv,) at the reference's beginning, scaled into the limits."""
    kinematics = Kinematics(robot)
    kinematics.update(q0)
    twist = pin.Motion(reference.velocity(0.0))
    # The difference is the reference's own velocity, without the error of a start off the path.
    still = tracking.linearize(kinematics, reference.placement(0.0))
    moving = tracking.linearize(kinematics, reference.placement(0.0), twist)
    v: Array = np.linalg.pinv(moving.J, rcond=1e-6) @ (moving.V - still.V)
    limit = robot.limits.velocity
    if limit is None:
        return v
    return v / max(1.0, float(limit.usage(v).max()))


def placement_of(robot: Robot, q: Array) -> pin.SE3:
    """Compute the placement of the task frame at a configuration (nq,)."""
    kinematics = Kinematics(robot, robot.scratch)
    kinematics.update(q)
    return kinematics.placement(robot.frame_id).copy()


def duration_at(
    robot: Robot, at_one_second: Reference, q0: Array, speed: float, dt: float
) -> float:
    """Compute the duration [s] for which the exact joint motion peaks at `speed` over limits.

    Args:
        robot: the robot, with velocity limits in force.
        at_one_second: the motion done in one second; joint speeds are proportional to 1/duration.
        q0: configuration at its beginning, (nq,).
        speed: peak of the joint speeds over their limits.
        dt: control period [s].

    Raises:
        DikbenchError: if no joint that it moves has a velocity limit, or the motion takes so few
            control periods that they miss its peak.
    """
    check_velocity_limits(robot, "the duration")
    motion = oracle_motion(robot, at_one_second, q0, np.linspace(0.0, 1.0, 201))
    duration = motion.peak_speed_ratio / speed
    periods = duration / dt
    stride = max(1, round(200 / max(periods, 1.0)))
    sampled = measure_motion(robot, motion.instants[::stride], motion.q[::stride])
    if periods < LEAST_PERIODS or sampled.peak_speed_ratio < LEAST_PEAK * motion.peak_speed_ratio:
        raise DikbenchError(
            f"at speed={speed:g} the motion takes {duration:.3g} s, {periods:.3g} control periods "
            f"of dt={dt:g} s, too few to follow it; give a smaller dt or a lower speed"
        )
    return duration


def check_velocity_limits(robot: Robot, what: str) -> None:
    """Check that a joint that moves the task frame has a velocity limit, from which `what` follows.

    Raises:
        DikbenchError: if none has.
    """
    limit = robot.limits.velocity
    if limit is None or not np.isfinite(limit.upper[robot.chain]).any():
        raise DikbenchError(
            f"robot {robot.name} has no velocity limits, from which {what} follows: give "
            "velocity=... [rad/s or m/s]"
        )


def least_norm_share(robot: Robot, q: Array, joint: int, tracking: TrackingTask = POSE) -> float:
    """Compute the smallest share of a joint in the least-norm velocity for its own effect.

    It is the entry (joint, joint) of J^+ J at configurations q (k, nq): 1 where no other joint
    velocity has this effect, less where the null space contains a part of it.
    """
    kinematics, rows, shares = Kinematics(robot), tracking.rows(robot), []
    for sample in q:
        kinematics.update(sample)
        J = kinematics.task_jacobian(rows)
        shares.append(pseudo_inverse(J, 1e-6)[joint] @ J[:, joint])
    return float(min(shares))


def samples(duration: float, dt: float, most: int = 200) -> Array:
    """Return the instants (k + 1,) [s] from end to end at which a certificate is measured.

    They are the control steps, or `most` intervals where there are more.
    """
    return np.linspace(0.0, duration, min(most, max(2, steps_in(duration, dt))) + 1)


def usual_claims(
    motion: OracleMotion,
    *,
    speed: tuple[float, float] | None = None,
    sigma_min: float | None = None,
    margin: float | None = None,
    remedy: str = "",
) -> tuple[Claim, ...]:
    """Make the usual claims about the exact motion; what is None is left out.

    Args:
        motion: the exact joint motion.
        speed: bounds on the peak of the joint speeds over their limits.
        sigma_min: lower bound on the smallest singular value of the task Jacobian (m, rad).
        margin: lower bound on the distance to a position limit [rad].
        remedy: what to change where the last two do not hold.
    """
    claims = []
    if speed is not None:
        claims.append(Claim("required speed over limit", motion.peak_speed_ratio, *speed))
    if sigma_min is not None:
        sigma = motion.sigma_min.min()
        claims.append(Claim("smallest singular value (m, rad)", sigma, sigma_min, remedy=remedy))
    if margin is not None:
        claims.append(Claim("position margin [rad]", motion.margin.min(), margin, remedy=remedy))
    return tuple(claims)


def there_and_back(robot: Robot, start: Array, offset: Array, duration: float) -> JointMotion:
    """Build the joint motion q(t) = start + sin^2(pi t/T) offset, with its derivative.

    Args:
        robot: the robot.
        start: configuration at both ends, (nq,).
        offset: from the start to the middle of the motion, (nv,) [rad or m].
        duration: T [s].
    """

    def q(tau: float) -> Array:
        moved: Array = pin.integrate(robot.model, start, np.sin(pi * tau / duration) ** 2 * offset)
        return moved

    def v(tau: float) -> Array:
        rate: Array = pi / duration * np.sin(2 * pi * tau / duration) * offset
        return rate

    return q, v


def at_constant_rate(robot: Robot, start: Array, rate: Array) -> JointMotion:
    """Build the joint motion q(t) = start + t rate, with its derivative.

    Args:
        robot: the robot.
        start: configuration at the beginning, (nq,).
        rate: joint velocity, (nv,) [rad/s or m/s].
    """

    def q(tau: float) -> Array:
        moved: Array = pin.integrate(robot.model, start, tau * rate)
        return moved

    return q, lambda tau: rate


def motion_of_a_step(robot: Robot, q0: Array, twist: Array, gain: float) -> OracleMotion:
    """Measure the motion that a proportional controller requires after a step of the target.

    It moves along the screw at gain times the distance, for the time 1/gain.

    Args:
        robot: the robot.
        q0: configuration at the start, (nq,).
        twist: the body twist (6,) that leads from the start to the target in one second.
        gain: gain of the tracking task [1/s].
    """
    start = placement_of(robot, q0)
    straight = along_screw(start, twist, lambda tau: gain * tau, lambda tau: gain, 1 / gain)
    return oracle_motion(robot, straight, q0, np.linspace(0.0, straight.duration, 51))


def from_rest_to_rest(
    robot: Robot, way: OracleMotion, duration: float, tracking: TrackingTask = POSE
) -> OracleMotion:
    """Measure a motion along the configurations of another, from rest to rest.

    The share of the other's time that is passed is sin^2(pi t/(2 T)).

    Args:
        robot: the robot.
        way: the other motion, of which the configurations at its samples are kept.
        duration: T [s].
        tracking: the task that follows the reference.
    """
    shares = (way.instants - way.instants[0]) / (way.instants[-1] - way.instants[0])
    instants = 2 * duration / pi * np.arcsin(np.sqrt(shares))
    return measure_motion(robot, instants, way.q, tracking)


def step_claims(motion: OracleMotion) -> tuple[Claim, Claim]:
    """Claim that the motion after a step meets no limit and no singularity."""
    return (
        Claim("smallest singular value on the way", motion.sigma_min.min(), at_least=0.03),
        Claim("position margin on the way [rad]", motion.margin.min(), at_least=0.05),
    )


def collision_claims(
    motion: OracleMotion, distance: Array, margin: float, *, depth: float, speed: float
) -> tuple[Claim, ...]:
    """Claim that a motion enters an obstacle and returns, away from limits and singularities.

    Args:
        motion: the exact joint motion.
        distance: the smallest distance at each of its samples, (k + 1,) [m], negative inside.
        margin: distance to keep [m].
        depth: smallest depth that the motion reaches inside [m].
        speed: peak of the joint speeds over their limits.
    """
    return (
        Claim("least distance of the reference's motion [m]", distance.min(), -0.1, -depth),
        Claim("distance at the start [m]", distance[0], at_least=1.5 * margin),
        Claim("distance at the end [m]", distance[-1], at_least=1.5 * margin),
        *usual_claims(motion, sigma_min=0.04, margin=0.1),
        *usual_claims(motion, speed=(0.8 * speed, 1.2 * speed)),
    )


def check_can_lift(robot: Robot, certified: tuple[str, ...]) -> None:
    """Check that an arm can lift.

    Raises:
        DikbenchError: if it moves in a plane; the message lists the `certified` robots.
    """
    if 2 not in robot.movable_rows:
        raise DikbenchError(
            f"robot {robot.name} moves in a plane and cannot lift; "
            f"valid: {', '.join(certified)}, a URDF"
        )
