"""A lift with a payload that the joints can hold but not throw."""

from __future__ import annotations

import numpy as np
import pinocchio as pin

from dikbench.errors import DikbenchError
from dikbench.scenario import (
    Array,
    Certificate,
    Claim,
    OracleMotion,
    PoseTask,
    Robot,
    Scenario,
    TorqueConstraint,
    Variation,
    between,
    effort_limits,
    limits_in_force,
    load_robot,
    oracle_motion,
    placement_of,
    positive,
    samples,
    secondary_tasks,
    through,
    with_payload,
)

ROBOTS = ("panda", "ur3", "ur5", "ur10", "xarm7", "tiago")
"""On which its defaults are certified; it takes any that is not planar and has effort limits."""

VARIATION = Variation(start=0.05, direction=0.2)


def torque_limited(
    robot: str = "panda",
    *,
    frame: str | None = None,
    height: float = 0.08,
    load: float = 0.85,
    demand: float = 1.15,
    dwell: float = 0.5,
    gain: float = 5.0,
    dt: float = 0.01,
    acceleration: bool = False,
    seed: int = 0,
) -> Scenario:
    """A payload that is lifted and lowered faster than the joints' torques allow, and held between.

    Straight up by `height`, orientation fixed, from rest to rest in the way of least jerk; a dwell;
    down again; a dwell. The payload, a ball of 5 cm radius in the hand, is so heavy that to hold it
    takes `load` of a joint's effort limit at the worst place on the way (not what the maker rates
    the arm for); the lift is so fast that the torques of its own joint motion peak at `demand`
    times the limits, setting off upwards and stopping at the bottom. Effort limits are in force,
    and torque constraints with them. Friction and the motors' inertia do not count. A seed moves
    the start by up to 0.05 rad per joint and turns the way up by up to 0.2 rad.

    Provokes: torques beyond the effort limits, at speeds inside the velocity limits

    Shows in: torque_usage_max, torque_violating_share, position_error_max_m, infeasible_share

    Args:
        robot: a robot's name, or the path of a URDF.
        frame: its task frame; default: the robot's.
        height: of the lift [m], 0.02 to 0.3.
        load: largest torque that it takes to hold the payload over the limits, 0.3 to 0.9.
        demand: largest torque of the reference's joint motion over the limits, 1.12 to 2.
        dwell: how long it is held at either end [s], 0.1 to 5.
        gain: of the tracking task, 1/s.
        dt: control period [s].
        acceleration: whether acceleration limits are in force.
        seed: 0 perturbs nothing.

    Source: least jerk: Flash & Hogan 1985; torques: Featherstone 2008 (recursive Newton-Euler).
    """
    positive("torque-limited", gain=gain, dt=dt)
    between("torque-limited", "height", height, 0.02, 0.3)
    between("torque-limited", "load", load, 0.3, 0.9)
    between("torque-limited", "demand", demand, 1.12, 2.0)
    between("torque-limited", "dwell", dwell, 0.1, 5.0)
    arm = limits_in_force(load_robot(robot, frame), acceleration=acceleration)
    arm = arm.with_limits(effort=arm.available_effort)
    effort_limits(arm)  # there are some
    if 2 not in arm.task_rows:
        raise DikbenchError(
            f"scenario torque-limited: robot {arm.name} moves in a plane and cannot lift; "
            f"valid: {', '.join(ROBOTS)}, a URDF"
        )
    change = VARIATION.drawn(seed)
    q0 = change.posture(arm, arm.q0)
    bottom = placement_of(arm, q0)
    up = change.rotation(arm) @ np.array([0.0, 0.0, height])
    places = [bottom, pin.SE3(bottom.rotation, bottom.translation + up)]
    rise = oracle_motion(arm, through([0.0, 1.0], places, smooth=True), q0, np.linspace(0, 1, 201))
    mass = _heaviest(arm, rise.q, load)
    arm = with_payload(arm, mass)
    time = _shortest(arm, rise, demand)
    there_and_back = [places[k] for k in (0, 1, 1, 0, 0)]
    times = np.cumsum([0.0, time, dwell, time, dwell]).tolist()
    reference = through(times, there_and_back, smooth=True)
    motion = oracle_motion(arm, reference, q0, samples(reference.duration, dt, most=1000))
    moving, held = _usage(arm, _torques(arm, motion)), _usage(arm, _gravity(arm, motion.q))
    certificate = Certificate(
        (
            Claim("torque of the motion over limit", moving, 1.1, 1.05 * demand),
            Claim("torque to hold it over limit", held, 0.95 * load, 1.01 * load),
            Claim("payload [kg]", mass, at_least=0.1),
            Claim("required speed over limit", motion.peak_speed_ratio, at_most=1.0),
            Claim("smallest singular value (m, rad)", motion.sigma_min.min(), at_least=0.03),
            Claim("position margin [rad]", motion.margin.min(), at_least=0.1),
        )
    )
    return Scenario(
        robot=arm,
        q0=q0,
        v0=np.zeros(arm.nv),
        reference=reference,
        tracking=PoseTask(gain=gain),
        dt=dt,
        duration=reference.duration,
        certificate=certificate,
        tasks=secondary_tasks(arm, q0),
        motion=motion,
        variation=VARIATION,
        constraints=(TorqueConstraint(),),
    )


def _gravity(arm: Robot, q: Array) -> Array:
    """The torques that hold the arm at configurations q (k, nq), (k, nv) [N m]."""
    return np.array([pin.computeGeneralizedGravity(arm.model, arm.scratch, x).copy() for x in q])


def _torques(arm: Robot, motion: OracleMotion) -> Array:
    """The torques of a joint motion at its inner samples, (k - 1, nv) [N m]."""
    period, v = float(motion.instants[1] - motion.instants[0]), motion.v
    return TorqueConstraint().torques(arm, motion.q[1:-1], v[1:], v[:-1], period)


def _usage(arm: Robot, torques: Array) -> float:
    """The largest torque over its limit."""
    assert arm.limits.effort is not None
    return float(arm.limits.effort.usage(torques).max())


def _heaviest(arm: Robot, q: Array, load: float) -> float:
    """The mass [kg] in the hand that takes `load` of a joint's limit to hold, at worst along q.

    Raises:
        DikbenchError: if the arm by itself takes as much.
    """
    empty = _gravity(arm, q)
    if (used := _usage(arm, empty)) >= load:
        raise DikbenchError(
            f"scenario torque-limited: robot {arm.name} takes {used:.2f} of its effort limits to "
            f"hold itself; load={load} must be above that"
        )
    return _first_at(arm, load, empty, _gravity(with_payload(arm, 1.0), q) - empty)


def _shortest(arm: Robot, rise: OracleMotion, demand: float) -> float:
    """The time [s] in which the torques of a motion done in one second peak at `demand`.

    What is not gravity goes with 1/time^2.
    """
    holding = _gravity(arm, rise.q[1:-1])
    return 1 / float(np.sqrt(_first_at(arm, demand, holding, _torques(arm, rise) - holding)))


def _first_at(arm: Robot, share: float, torques: Array, slope: Array) -> float:
    """The smallest x at which a joint of torques + x slope, (k, nv), is at `share` of its limit."""
    assert arm.limits.effort is not None
    limit = share * arm.limits.effort.upper
    with np.errstate(divide="ignore"):
        x: Array = (limit - np.sign(slope) * torques) / np.abs(slope)
    return float(x.min())
