"""A start a little outside a position limit."""

from __future__ import annotations

from collections.abc import Mapping
from types import MappingProxyType
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
    least_norm_share,
    limits_in_force,
    load_robot,
    positive,
    samples,
    secondary_tasks,
)

JOINTS: Mapping[str, int] = MappingProxyType(
    {
        "ur5": 5,
        "ur3": 5,
        "ur10": 5,
        "panda": 5,
        "xarm7": 3,
        "kinova": 4,
        "tiago": 6,
        "talos": 5,
        "planar3r": 2,
    }
)
"""The joint (index into v) that is outside its upper limit: no null space brings it back."""

VARIATION = Variation(start=0.05, timing=0.1)


def start_outside(
    robot: Literal[
        "ur5", "ur3", "ur10", "panda", "xarm7", "kinova", "tiago", "talos", "planar3r"
    ] = "ur5",
    *,
    outside: float = 5e-3,
    rate: float = 0.05,
    gain: float = 5.0,
    dt: float = 0.01,
    duration: float = 2.0,
    acceleration: bool = False,
    seed: int = 0,
) -> Scenario:
    """A start outside a position limit, as after a push or a calibration, and a slow way inside.

    One joint stands `outside` beyond its upper limit, the others as at the robot's start; the task
    frame is to follow q_j(t) = q_max,j + outside - rate t, which is inside after outside/rate
    seconds; with a rate of 0 it is to stay where it is, and only who gives it up gets inside. Many
    programs have no feasible point here: libraries raise, stand still or push back. A seed moves
    the other joints by up to 0.05 rad and changes the rate by up to 10 %.

    Provokes: programs without a feasible point, and too hasty ways back

    Shows in: infeasible_share, position_violation_max_rad, velocity_peak_ratio

    Args:
        robot: ur5, ur3, ur10, panda, xarm7, kinova, tiago, talos or planar3r.
        outside: distance of the start from the limit [rad], 1e-4 to 1e-2.
        rate: of the joint on the way inside [rad/s], 0 to 0.5.
        gain: of the tracking task, 1/s.
        dt: control period [s].
        duration: [s].
        acceleration: whether acceleration limits are in force.
        seed: 0 perturbs nothing.

    Source: by construction; what users of Pink and PlaCo ask about.
    """
    positive("start-outside", gain=gain, dt=dt, duration=duration)
    between("start-outside", "outside", outside, 1e-4, 1e-2)
    between("start-outside", "rate", rate, 0.0, 0.5)
    arm = limits_in_force(load_robot(robot), acceleration=acceleration)
    change, j = VARIATION.drawn(seed), JOINTS[robot]
    assert arm.limits.position is not None
    start = change.posture(arm, arm.q0, (j,)).copy()
    start[arm.limits.q_index[j]] = arm.limits.position.upper[j] + outside
    inward = np.zeros(arm.nv)
    inward[j] = -rate / change.pace

    def q_r(tau: float) -> Array:
        q: Array = pin.integrate(arm.model, start, tau * inward)
        return q

    motion = joint_oracle(arm, q_r, samples(duration, dt))
    travel = duration * rate / change.pace
    inside = motion.margin[-1] - motion.margin[0]
    certificate = Certificate(
        (
            Claim("margin at the start [rad]", motion.margin[0], -1.001e-2, -0.99e-4),
            Claim("way towards the inside [rad]", inside, 0.99 * min(travel, 0.1), travel + 1e-9),
            Claim("its share in the least-norm motion", least_norm_share(arm, motion.q, j), 0.8),
            Claim("smallest singular value (m, rad)", motion.sigma_min.min(), at_least=0.03),
            Claim("required speed over limit", motion.peak_speed_ratio, at_most=0.9),
        )
    )
    return Scenario(
        robot=arm,
        q0=start,
        v0=inward.copy(),
        reference=joint_path(arm, q_r, lambda tau: inward, duration),
        tracking=PoseTask(gain=gain),
        dt=dt,
        duration=duration,
        certificate=certificate,
        tasks=secondary_tasks(arm, arm.q0),
        motion=motion,
        variation=VARIATION,
    )
