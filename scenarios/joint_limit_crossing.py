"""A path whose own joint motion crosses a position limit and comes back."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from math import pi
from types import MappingProxyType
from typing import Literal

import numpy as np
import pinocchio as pin

from dikbench.errors import DikbenchError
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

VARIATION = Variation(start=0.1)


@dataclass(frozen=True)
class Crossing:
    """Where a robot meets a limit.

    Attributes:
        posture: the other joints' posture [rad] (the crossing joint's own entry is not read).
        joint: the joint that crosses its upper limit (index into v).
    """

    posture: tuple[float, ...]
    joint: int


CROSSINGS: Mapping[str, Crossing] = MappingProxyType(
    {
        "ur5": Crossing((0.0, -1.2, 1.4, -1.7, -1.4, 0.2), 0),
        "ur3": Crossing((0.0, -1.2, 1.4, -1.7, -1.4, 0.2), 0),
        "ur10": Crossing((0.0, -1.2, 1.4, -1.7, -1.4, 0.2), 3),
        "xarm7": Crossing((0.0, -0.5, 0.0, 1.0, 0.0, 1.3, 0.0), 3),
        "tiago": Crossing((1.4, -0.4, -1.2, 1.5, 0.0, -0.5, 0.4), 3),
        "talos": Crossing((-0.4, 0.9, 0.6, -1.5, 0.5, 0.5, -0.1), 5),
        "lwr": Crossing((0.0, 0.8, 0.8, 0.8, 0.8, 0.8, 0.0), 3),
        "planar3r": Crossing((0.3, 1.6, 0.6), 2),
        "panda": Crossing((0.0, -0.3, 0.0, -1.8, 0.0, 0.0, pi / 4), 5),
    }
)


def joint_limit_crossing(
    robot: Literal[
        "ur5", "panda", "ur3", "ur10", "xarm7", "tiago", "talos", "lwr", "planar3r"
    ] = "ur5",
    *,
    approach: float = 0.3,
    depth: float = 0.2,
    speed: float = 0.5,
    gain: float = 5.0,
    dt: float = 0.01,
    acceleration: bool = False,
    seed: int = 0,
) -> Scenario:
    """A path whose own joint motion crosses a position limit and comes back.

    One joint j moves as q_j(t) = q_max,j - approach + (approach + depth) sin^2(pi t/T), the others
    stand still, and the task frame is asked to follow: the target is out of reach, by this posture,
    while q_j is beyond its limit. UR3 and UR5 cross with their base, the UR10 with joint 4, the
    Panda and Talos with joint 6, TIAGo, xArm7 and LWR with their elbow, the planar arm with its
    last joint: most of their least-norm motion is this joint's, too, so that no null space spares
    it. A seed moves the other joints by up to 0.1 rad.

    Provokes: a path that leads out of a joint's range

    Shows in: position_violation_max_rad, off_course_max_rad

    Args:
        robot: one of those above.
        approach: how far inside the limit the motion starts [rad], 0.02 to 3.
        depth: how far beyond the limit it goes [rad], 0.02 to 0.5.
        speed: peak speed of the joint over its limit, 0.05 to 1.
        gain: of the tracking task, 1/s.
        dt: control period [s].
        acceleration: whether acceleration limits are in force.
        seed: 0 perturbs nothing.

    Source: by construction; limits as in Flacco, De Luca & Khatib 2015.
    """
    positive("joint-limit-crossing", gain=gain, dt=dt)
    between("joint-limit-crossing", "approach", approach, 0.02, 3.0)
    between("joint-limit-crossing", "depth", depth, 0.02, 0.5)
    between("joint-limit-crossing", "speed", speed, 0.05, 1.0)
    arm = limits_in_force(load_robot(robot), acceleration=acceleration)
    position, velocity = arm.limits.position, arm.limits.velocity
    if position is None or velocity is None:
        raise DikbenchError(f"scenario joint-limit-crossing: robot {robot} has no limits")
    where = CROSSINGS[robot]
    j = where.joint
    start = VARIATION.drawn(seed).posture(arm, np.array(where.posture), (j,))
    start[j] = position.upper[j] - approach
    amplitude = approach + depth
    duration = pi * amplitude / (speed * velocity.upper[j])
    out = np.zeros(arm.nv)
    out[j] = 1.0

    def q_r(tau: float) -> Array:
        q: Array = pin.integrate(
            arm.model, start, amplitude * np.sin(pi * tau / duration) ** 2 * out
        )
        return q

    def v_r(tau: float) -> Array:
        v: Array = amplitude * pi / duration * np.sin(2 * pi * tau / duration) * out
        return v

    motion = joint_oracle(arm, q_r, samples(duration, dt))
    certificate = Certificate(
        (
            Claim("position margin at the start [rad]", motion.margin[0], 0.9 * approach),
            Claim("deepest margin of the motion [rad]", motion.margin.min(), at_most=-0.8 * depth),
            Claim("smallest singular value (m, rad)", motion.sigma_min.min(), at_least=0.03),
            Claim("its share in the least-norm motion", least_norm_share(arm, motion.q, j), 0.8),
            Claim("required speed over limit", motion.speed_ratio.max(), 0.8 * speed, 1.05 * speed),
        )
    )
    return Scenario(
        robot=arm,
        q0=start,
        v0=v_r(0.0),
        reference=joint_path(arm, q_r, v_r, duration),
        tracking=PoseTask(gain=gain),
        dt=dt,
        duration=duration,
        certificate=certificate,
        tasks=secondary_tasks(arm, start),
        motion=motion,
        variation=VARIATION,
    )
