"""A path whose own joint motion brings the arm into itself and comes back."""

from __future__ import annotations

from collections.abc import Mapping
from math import pi
from types import MappingProxyType
from typing import Literal

import numpy as np
import pinocchio as pin

from dikbench.scenario import (
    Array,
    Certificate,
    Claim,
    CollisionConstraint,
    PoseTask,
    Reference,
    Robot,
    Scenario,
    Variation,
    between,
    duration_at,
    influence_distance,
    joint_path,
    limits_in_force,
    load_robot,
    oracle_motion,
    positive,
    samples,
    secondary_tasks,
    start_velocity,
)

WAYS: Mapping[str, tuple[float, ...]] = MappingProxyType(
    {
        "panda": (0.0, 1.1, 0.0, -0.5, 0.0, 0.0, 0.0),
        "ur3": (0.0, 0.0, 0.9, 1.4, 0.0, 0.0),
        "ur5": (0.0, 0.0, 1.3, 0.9, 0.0, 0.0),
        "ur10": (0.0, 0.0, 1.3, 1.4, 0.0, 0.0),
        "xarm7": (0.0, 0.9, 0.0, -0.8, 0.0, 0.0, 0.0),
        "kinova": (0.0, 0.0, -0.5, -0.7, 0.0, 0.0),
        "tiago": (0.0, -0.3, 0.9, 0.0, 0.0, 0.0, 0.0),
        "talos": (0.0, 0.0, -1.3, -0.6, 0.0, -0.5, 0.0),
    }
)
"""From the start into the arm itself [rad]."""

MARGIN = 0.01
"""Distance to keep [m]."""

VARIATION = Variation(start=0.03, timing=0.1)


def self_collision(
    robot: Literal["panda", "ur3", "ur5", "ur10", "xarm7", "kinova", "tiago", "talos"] = "panda",
    *,
    speed: float = 0.3,
    gain: float = 5.0,
    dt: float = 0.01,
    acceleration: bool = False,
    seed: int = 0,
) -> Scenario:
    """A path whose own joint motion brings the arm into itself and comes back.

    The joints move as q(t) = q_0 + sin^2(pi t/T) d and the task frame is asked to follow: the hand
    goes into the base (panda, xarm7, tiago), the upper arm (ur3, ur5, ur10, kinova) or the chest
    (talos), by more than 0.02 m half way, as `dikbench.robots.collision.bodies` measures
    it; these are capsules around the meshes, so that the true bodies may have some room left. The
    margin is 0.01 m. A seed moves the start by up to 0.03 rad per joint and changes the duration by
    up to 10 %.

    Provokes: an arm that folds into itself

    Shows in: distance_min_m, distance_violation_max_m, position_error_max_m

    Args:
        robot: one of those above.
        speed: peak of the motion's joint speeds over their limits, 0.05 to 0.9.
        gain: of the tracking task, 1/s.
        dt: control period [s].
        acceleration: whether acceleration limits are in force.
        seed: 0 perturbs nothing.

    Source: by construction; Kanoun et al. 2011 (self-collision as rows of a program).
    """
    positive("self-collision", gain=gain, dt=dt)
    between("self-collision", "speed", speed, 0.05, 0.9)
    arm = limits_in_force(load_robot(robot), acceleration=acceleration)
    change, way = VARIATION.drawn(seed), np.array(WAYS[robot])
    q0 = change.posture(arm, arm.q0)
    duration = duration_at(arm, _there_and_back(arm, q0, way, 1.0), q0, speed) * change.pace
    reference = _there_and_back(arm, q0, way, duration)
    motion = oracle_motion(arm, reference, q0, samples(duration, dt, most=100))
    constraint = CollisionConstraint(
        margin=MARGIN, influence=influence_distance(acceleration=acceleration)
    )
    distance = constraint.distances(arm, motion.q)
    certificate = Certificate(
        (
            Claim("least distance of the reference's motion [m]", distance.min(), -0.1, -0.02),
            Claim("distance at the start [m]", distance[0], at_least=1.5 * MARGIN),
            Claim("distance at the end [m]", distance[-1], at_least=1.5 * MARGIN),
            Claim("smallest singular value (m, rad)", motion.sigma_min.min(), at_least=0.04),
            Claim("position margin [rad]", motion.margin.min(), at_least=0.1),
            Claim("required speed over limit", motion.peak_speed_ratio, 0.8 * speed, 1.2 * speed),
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
        motion=motion,
        variation=VARIATION,
        constraints=(constraint,),
    )


def _there_and_back(arm: Robot, start: Array, way: Array, duration: float) -> Reference:
    """The path of the task frame as the joints go from the start (nq,) along `way` (nv,)."""

    def q_r(tau: float) -> Array:
        q: Array = pin.integrate(arm.model, start, np.sin(pi * tau / duration) ** 2 * way)
        return q

    def v_r(tau: float) -> Array:
        v: Array = pi / duration * np.sin(2 * pi * tau / duration) * way
        return v

    return joint_path(arm, q_r, v_r, duration)
