"""A path whose exact joint motion crosses a position limit and comes back."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from math import inf, pi
from types import MappingProxyType
from typing import Annotated, Literal

import numpy as np

from dikbench.errors import DikbenchError
from dikbench.problem import Array, Drawn, Range, Robot
from dikbench.scenario import (
    Case,
    Claim,
    NamedRobotFamily,
    Perturbation,
    Variation,
    joint_oracle,
    joint_path,
    least_norm_share,
    samples,
    there_and_back,
    usual_claims,
)


@dataclass(frozen=True)
class Crossing:
    """The posture and the joint with which a robot crosses a limit.

    Attributes:
        posture: the other joints' posture [rad] (the crossing joint's entry is ignored).
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


@dataclass(frozen=True, kw_only=True)
class JointLimitCrossing(NamedRobotFamily):
    """A path whose exact joint motion crosses a position limit and comes back.

    One joint j moves as q_j(t) = q_max,j - approach + (approach + depth) sin^2(pi t/T), the others
    rest, and the task frame follows: in this posture the target is out of reach while q_j is beyond
    its limit. UR3 and UR5 cross with their base, the UR10 with joint 4, the Panda and Talos with
    joint 6, TIAGo, xArm7 and LWR with their elbow, the planar arm with its last joint: this joint
    makes most of their least-norm motion, so that the null space does not replace it. A seed moves
    the other joints by up to 0.1 rad.

    Provokes: a path that leads out of a joint's range

    Shows in: position_violation_max_rad, direction_error_max_rad

    Attributes:
        robot: one of these robots.
        approach: distance of the start inside the limit.
        depth: largest distance beyond the limit.
        speed: peak speed of the joint over its limit.

    Source: by construction; limits as in Flacco, De Luca & Khatib 2015.
    """

    robot: Literal["ur5", "panda", "ur3", "ur10", "xarm7", "tiago", "talos", "lwr", "planar3r"] = (
        "ur5"
    )
    approach: Annotated[float, Range(0.02, 3.0, "rad"), Drawn(0.1, 0.5)] = 0.3
    depth: Annotated[float, Range(0.02, 0.5, "rad"), Drawn(0.05, 0.4)] = 0.2
    speed: Annotated[float, Range(0.05, 1.0), Drawn(0.2, 0.9)] = 0.5

    variation = Variation(start=0.1)
    about_position_limits = True

    def case(self, robot: Robot, change: Perturbation) -> Case:
        """See `Family`."""
        position, velocity = robot.limits.position, robot.limits.velocity
        if position is None or velocity is None:
            raise DikbenchError(f"robot {self.robot} has no position limits")
        where = CROSSINGS[self.robot]
        j = where.joint
        start = change.posture(robot, np.array(where.posture), (j,))
        start[j] = position.upper[j] - self.approach
        amplitude, out = self.approach + self.depth, np.zeros(robot.nv)
        duration = pi * amplitude / (self.speed * velocity.upper[j])
        out[j] = 1.0
        q_r, _ = there_and_back(robot, start, amplitude * out, duration)

        def v_r(tau: float) -> Array:
            v: Array = amplitude * pi / duration * np.sin(2 * pi * tau / duration) * out
            return v

        motion = joint_oracle(robot, q_r, samples(duration, self.dt))
        share = least_norm_share(robot, motion.q, j)
        claims = (
            Claim("position margin at the start [rad]", motion.margin[0], 0.9 * self.approach),
            Claim(
                "deepest margin of the motion [rad]", motion.margin.min(), -inf, -0.8 * self.depth
            ),
            *usual_claims(motion, sigma_min=0.03),
            Claim("its share in the least-norm motion", share, 0.8),
            *usual_claims(motion, speed=(0.8 * self.speed, 1.05 * self.speed)),
        )
        reference = joint_path(robot, q_r, v_r, duration)
        return Case(reference, start, motion, claims, v0=v_r(0.0))
