"""A goal whose shortest way leads out of a joint's range, while the long way is free."""

from __future__ import annotations

from math import pi
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
    limits_in_force,
    load_robot,
    placement_of,
    positive,
    samples,
    target_at_rest,
)

VARIATION = Variation(start=0.2, direction=0.2)

CALM = 0.8
"""Peak speed of the way round over the velocity limit."""


def greedy_trap(
    robot: Literal["planar1r"] = "planar1r",
    *,
    start: float = 0.5,
    goal: float = 5.5,
    gain: float = 2.0,
    dt: float = 0.01,
    acceleration: bool = False,
    seed: int = 0,
) -> Scenario:
    """A local minimum by design: one joint with limits 0 and 2 pi, its goal the other way round.

    From q = start the orientation of q = goal is nearer through 0, where the limit is, than through
    pi: a law that follows the error sticks at 0, and no tuning helps it. There is a motion that
    arrives, inside all limits: the long way, start + (goal - start) sin^2(pi t/(2 T)). A seed moves
    the start by up to 0.2 rad and the goal by up to 0.2 rad.

    Provokes: a local minimum, in which every law that follows the error sticks

    Shows in: orientation_error_final_rad, stuck_share

    Args:
        robot: planar1r.
        start: of the joint [rad], 0.3 to 1.2.
        goal: of the joint [rad], 4.9 to 6.
        gain: of the tracking task, 1/s.
        dt: control period [s].
        acceleration: whether acceleration limits are in force.
        seed: 0 perturbs nothing.

    Source: by construction; the limits of every greedy method.
    """
    positive("greedy-trap", gain=gain, dt=dt)
    between("greedy-trap", "start", start, 0.3, 1.2)
    between("greedy-trap", "goal", goal, 4.9, 6.0)
    arm = limits_in_force(load_robot(robot), acceleration=acceleration)
    change = VARIATION.drawn(seed)
    q0 = change.posture(arm, np.array([start]))
    turned = goal + float(pin.log3(change.rotation(arm))[2])
    assert arm.limits.velocity is not None
    way = turned - q0
    duration = pi * float(way[0]) / (2 * CALM * float(arm.limits.velocity.upper[0]))

    def way_round(tau: float) -> Array:
        q: Array = q0 + way * np.sin(pi / 2 * min(tau / duration, 1.0)) ** 2
        return q

    motion = joint_oracle(arm, way_round, samples(duration, dt))
    target = placement_of(arm, np.array([turned]))
    shortest = float(pin.log3(placement_of(arm, q0).rotation.T @ target.rotation)[2])
    missed = float(np.abs(pin.log6(target.actInv(placement_of(arm, motion.q[-1]))).np).max())
    certificate = Certificate(
        (
            Claim("end of the shortest way, past a limit at 0 [rad]", q0[0] + shortest, -pi, -0.05),
            Claim("position margin of the way round [rad]", motion.margin.min(), at_least=0.05),
            Claim("error at the end of the way round (m, rad)", missed, at_most=1e-9),
            Claim("its required speed over limit", motion.peak_speed_ratio, at_most=0.9),
        )
    )
    return Scenario(
        robot=arm,
        q0=q0,
        v0=np.zeros(1),
        reference=target_at_rest(target, duration),
        tracking=PoseTask(gain=gain),
        dt=dt,
        duration=duration,
        certificate=certificate,
        motion=motion,
        variation=VARIATION,
    )
