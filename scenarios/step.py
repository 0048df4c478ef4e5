"""A step to a target far away and far turned."""

from __future__ import annotations

from collections.abc import Mapping
from types import MappingProxyType
from typing import Literal

import numpy as np
import pinocchio as pin

from dikbench.scenario import (
    Certificate,
    Claim,
    PoseTask,
    Reference,
    Scenario,
    Variation,
    between,
    limits_in_force,
    load_robot,
    oracle_motion,
    placement_of,
    positive,
    secondary_tasks,
    start_velocity,
    target_at_rest,
)

VARIATION = Variation(start=0.1, direction=0.2)

DIRECTIONS: Mapping[str, tuple[tuple[int, int, int], tuple[int, int, int]]] = MappingProxyType(
    {
        "panda": ((1, -1, 0), (1, -1, 1)),
        "ur3": ((1, 0, 0), (1, -1, 1)),
        "ur5": ((0, 1, 0), (-1, -1, -1)),
        "ur10": ((1, 1, 0), (-1, -1, -1)),
        "xarm7": ((-1, 1, -1), (-1, 1, 1)),
        "kinova": ((0, -1, -1), (-1, 0, 0)),
        "tiago": ((-1, 1, 0), (1, 1, 0)),
        "talos": ((0, -1, 0), (-1, 0, -1)),
    }
)
"""Where the target lies and about what it is turned, in the axes of the task frame at the start:
a way on which the arm meets neither a limit nor a singularity."""

LEAST = 0.1
"""First speed over the limits, per gain [1/s] and angle [rad], that a step asks for at least."""


def step(
    robot: Literal["panda", "ur3", "ur5", "ur10", "xarm7", "kinova", "tiago", "talos"] = "panda",
    *,
    distance: float = 0.2,
    angle: float = 1.5,
    gain: float = 5.0,
    dt: float = 0.01,
    duration: float = 4.0,
    acceleration: bool = False,
    seed: int = 0,
) -> Scenario:
    """A step to a target far away and far turned: the first commands ask for too much.

    X_d = (R exp3(angle a), p + distance R d), from the first instant on, with a and d unit vectors
    in the axes of the frame, chosen for each robot such that the straight way there, the screw
    X exp6(s log6(X^-1 X_d)), is free. A law without limits begins at gain times the error. A seed
    moves the start by up to 0.1 rad per joint and turns a and d by up to 0.2 rad.

    Provokes: an error that asks for joint speeds beyond the limits at once

    Shows in: off_course_max_rad, velocity_violation_max_rad_s, progress_min

    Args:
        robot: one of the arms in space.
        distance: of the target [m], 0.05 to 0.3.
        angle: of the target [rad], 0.5 to 2.62 (30 to 150 deg).
        gain: of the tracking task, 1/s.
        dt: control period [s].
        duration: [s].
        acceleration: whether acceleration limits are in force.
        seed: 0 perturbs nothing.

    Source: step response; the screw: Lynch & Park, Modern Robotics, 2017.
    """
    positive("step", gain=gain, dt=dt, duration=duration)
    between("step", "distance", distance, 0.05, 0.3)
    between("step", "angle", angle, 0.5, 2.62)
    arm = limits_in_force(load_robot(robot), acceleration=acceleration)
    change = VARIATION.drawn(seed)
    q0 = change.posture(arm, arm.q0)
    start = placement_of(arm, q0)
    d, a = (
        change.rotation(arm) @ (np.array(direction) / np.linalg.norm(direction))
        for direction in DIRECTIONS[robot]
    )
    target = pin.SE3(
        start.rotation @ pin.exp3(angle * a), start.translation + distance * start.rotation @ d
    )
    twist = pin.log6(start.actInv(target))
    # The motion that a gain asks for: straight there, at first at gain times the distance.
    straight = Reference(
        1 / gain, lambda tau: start * pin.exp6(gain * tau * twist), lambda tau: gain * twist.np
    )
    motion = oracle_motion(arm, straight, q0, np.linspace(0.0, straight.duration, 51))
    reference = target_at_rest(target, duration)
    certificate = Certificate(
        (
            Claim("smallest singular value on the way", motion.sigma_min.min(), at_least=0.03),
            Claim("position margin on the way [rad]", motion.margin.min(), at_least=0.05),
            Claim("first speed over limit", motion.speed_ratio[0], at_least=LEAST * gain * angle),
        )
    )
    return Scenario(
        robot=arm,
        q0=q0,
        v0=start_velocity(arm, reference, q0),
        reference=reference,
        tracking=PoseTask(gain=gain),
        dt=dt,
        duration=duration,
        certificate=certificate,
        tasks=secondary_tasks(arm, q0),
        variation=VARIATION,
    )
