"""A joint that is driven at its limit at speed, with little deceleration to stop it."""

from __future__ import annotations

from typing import Literal

import numpy as np
import pinocchio as pin

from dikbench.scenario import (
    Array,
    Certificate,
    Claim,
    PoseTask,
    Scenario,
    Variation,
    between,
    joint_oracle,
    joint_path,
    load_robot,
    positive,
    samples,
)

JOINTS = {"pan": 0, "wrist_3": 5}
"""Whose motion no other joint can make: the arms have six joints, and are not singular here."""

POSTURE = (0.0, -1.2, 1.4, -1.7, -1.4, 0.2)

ROOM = 1.25
"""The motion starts this many braking distances before the limit."""

VARIATION = Variation(start=0.1, timing=0.05)


def joint_limit_approach(
    robot: Literal["ur5", "ur3", "ur10"] = "ur5",
    *,
    joint: Literal["pan", "wrist_3"] = "pan",
    deceleration: float = 5.0,
    speed: float = 0.9,
    depth: float = 0.2,
    gain: float = 5.0,
    dt: float = 0.005,
    seed: int = 0,
) -> Scenario:
    """A joint that is driven towards its limit, and beyond, at a share of its velocity limit.

    The joint moves at a constant rate v = speed v_max, from 1.25 braking distances v^2/(2 a) (and
    at least 0.3 rad) before its upper limit to `depth` beyond it, or further, for as long as who
    brakes in time takes to stop; all others stand still, and the task frame is asked to follow.
    Acceleration limits of a [rad/s^2] are in force on every joint.
    Who looks one step ahead brakes too late: in the end the position or the acceleration limit
    gives way. A seed moves the other joints by up to 0.1 rad and changes the rate by up to 5 %.

    Provokes: braking before a position limit with little deceleration

    Shows in: position_violation_max_rad, acceleration_violation_max_rad_s2, relaxed_share

    Args:
        robot: ur5, ur3 or ur10.
        joint: pan (the first) or wrist_3 (the last).
        deceleration: a [rad/s^2], 2 to 50.
        speed: of the joint over its limit, 0.1 to 0.95.
        depth: how far beyond the limit the path goes at least [rad], 0.02 to 0.5.
        gain: of the tracking task, 1/s.
        dt: control period [s].
        seed: 0 perturbs nothing.

    Source: Flacco, De Luca & Khatib 2012; Del Prete 2018 (viability of braking in discrete time).
    """
    positive("joint-limit-approach", gain=gain, dt=dt)
    between("joint-limit-approach", "deceleration", deceleration, 2.0, 50.0)
    between("joint-limit-approach", "speed", speed, 0.1, 0.95)
    between("joint-limit-approach", "depth", depth, 0.02, 0.5)
    arm = load_robot(robot).with_limits(acceleration=deceleration)
    change, j = VARIATION.drawn(seed), JOINTS[joint]
    position, velocity = arm.limits.position, arm.limits.velocity
    assert position is not None
    assert velocity is not None
    rate = speed / change.pace * velocity.upper[j]
    braking = rate**2 / (2 * deceleration)
    start = change.posture(arm, np.array(POSTURE), (j,)).copy()
    room = max(ROOM * braking, 0.3)
    start[j] = position.upper[j] - room
    out = np.zeros(arm.nv)
    out[j] = rate
    stopped = (room - braking) / rate + rate / deceleration  # at full rate, then braking
    duration = float(max((room + depth) / rate, 1.05 * stopped))

    def q_r(tau: float) -> Array:
        q: Array = pin.integrate(arm.model, start, tau * out)
        return q

    motion = joint_oracle(arm, q_r, samples(duration, dt))
    before = float(position.upper[j] - motion.q[0][j])
    certificate = Certificate(
        (
            Claim("room before the limit over the braking distance", before / braking, 1.0),
            # Less than half a turn beyond it, or the shortest way to the target is another one.
            Claim("deepest margin of the motion [rad]", motion.margin.min(), -3.0, -0.8 * depth),
            Claim("duration over the time to stop", duration / stopped, at_least=1.0),
            Claim("smallest singular value (m, rad)", motion.sigma_min.min(), at_least=0.03),
            Claim("required speed over limit", motion.peak_speed_ratio, 0.9 * speed, 0.999),
        )
    )
    return Scenario(
        robot=arm,
        q0=start,
        v0=out.copy(),
        reference=joint_path(arm, q_r, lambda tau: out, duration),
        tracking=PoseTask(gain=gain),
        dt=dt,
        duration=duration,
        certificate=certificate,
        motion=motion,
        variation=VARIATION,
    )
