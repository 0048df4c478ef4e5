"""A joint that moves towards its limit fast, with little deceleration to stop it."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from math import pi
from types import MappingProxyType
from typing import Annotated, Literal

import numpy as np

from dikbench.problem import Drawn, Range, Robot
from dikbench.scenario import (
    Case,
    Claim,
    NamedRobotFamily,
    Perturbation,
    Variation,
    at_constant_rate,
    joint_oracle,
    joint_path,
    least_norm_share,
    samples,
    usual_claims,
)

UR = (0.0, -1.2, 1.4, -1.7, -1.4, 0.2)

POSTURES_RAD: Mapping[str, tuple[float, ...]] = MappingProxyType(
    {
        "ur5": UR,
        "ur3": UR,
        "ur10": UR,
        "panda": (0.0, -0.8, pi / 2, -1.3, pi / 2, 0.7, 0.0),
        "xarm7": (0.0, -0.6, pi / 2, 0.9, -pi / 2, 1.7, 0.0),
        "tiago": (0.0, -0.1, -pi / 2, 1.5, 0.0, -0.5, 0.0),
        "lwr": (0.0, -1.0, pi / 2, 0.8, pi / 2, 0.6, 0.0),
    }
)
"""Postures in which no other joint replaces the motion of the first and the last one: six joints
that are not singular, or seven of which the null space moves the five between them."""

BRAKING_DISTANCES = 1.25
"""Braking distances from the start of the motion to the limit."""


@dataclass(frozen=True, kw_only=True)
class JointLimitApproach(NamedRobotFamily):
    """A joint that moves towards its limit and beyond, at a share of its velocity limit.

    The joint moves at a constant rate v = speed v_max, from 1.25 braking distances v^2/(2 a) (and
    at least 0.3 rad) before its upper limit to `depth` beyond it, or further until a joint that
    brakes in time has stopped; the others rest, and the task frame follows. Acceleration limits of
    a [rad/s^2] are in force on every joint. A formulation that looks one step ahead brakes too late
    and violates the position or the acceleration limit. An arm with seven joints has a posture in
    which its null space moves neither the first nor the last of them. A seed moves the other joints
    by up to 0.1 rad and changes the rate by up to 5 %.

    Provokes: braking before a position limit with little deceleration

    Shows in: position_violation_max_rad, acceleration_violation_max_rad_s2, relaxed_share

    Attributes:
        robot: one of these robots.
        joint: pan (the first) or wrist_3 (the last).
        deceleration: a.
        speed: speed of the joint over its limit.
        depth: smallest distance of the end of the path beyond the limit.

    Source: Flacco, De Luca & Khatib 2012; Del Prete 2018 (viability of braking in discrete time).
    """

    robot: Literal["ur5", "ur3", "ur10", "panda", "xarm7", "tiago", "lwr"] = "ur5"
    acceleration: Literal[False] = False
    dt: float = 0.005
    joint: Annotated[Literal["pan", "wrist_3"], Drawn()] = "pan"
    deceleration: Annotated[float, Range(2.0, 50.0, "rad/s^2"), Drawn(2.0, 25.0, log=True)] = 5.0
    speed: Annotated[float, Range(0.1, 0.95), Drawn(0.3, 0.95)] = 0.9
    depth: Annotated[float, Range(0.02, 0.5, "rad"), Drawn(0.05, 0.4)] = 0.2

    variation = Variation(start=0.1, timing=0.05)
    about_position_limits = True

    def case(self, robot: Robot, change: Perturbation) -> Case:
        """See `Family`."""
        arm = robot.with_limits(acceleration=self.deceleration)
        j = 0 if self.joint == "pan" else arm.nv - 1
        position, velocity = arm.limits.position, arm.limits.velocity
        assert position is not None
        assert velocity is not None
        rate = self.speed / change.pace * velocity.upper[j]
        braking = rate**2 / (2 * self.deceleration)
        start = change.posture(arm, np.array(POSTURES_RAD[self.robot]), (j,)).copy()
        room = max(BRAKING_DISTANCES * braking, 0.3)
        start[j] = position.upper[j] - room
        out = np.zeros(arm.nv)
        out[j] = rate
        stopped = (room - braking) / rate + rate / self.deceleration  # at full rate, then braking
        duration = float(max((room + self.depth) / rate, 1.05 * stopped))
        q_r, v_r = at_constant_rate(arm, start, out)
        motion = joint_oracle(arm, q_r, samples(duration, self.dt))
        before = float(position.upper[j] - motion.q[0][j])
        deepest = motion.margin.min()
        claims = (
            Claim("room before the limit over the braking distance", before / braking, 1.0),
            # Less than half a turn beyond it, or the shortest rotation to the target changes.
            Claim("deepest margin of the motion [rad]", deepest, -3.0, -0.8 * self.depth),
            *usual_claims(motion, sigma_min=0.03),
            Claim("its share in the least-norm motion", least_norm_share(arm, motion.q, j), 0.9),
            *usual_claims(motion, speed=(0.9 * self.speed, 0.999)),
        )
        reference = joint_path(arm, q_r, v_r, duration)
        return Case(reference, start, motion, claims, robot=arm, v0=out.copy())
