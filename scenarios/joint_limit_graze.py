"""A path on which a joint comes close to its limit and turns back inside."""

from __future__ import annotations

from dataclasses import dataclass
from math import pi
from typing import Annotated, Literal

import numpy as np

from dikbench.errors import DikbenchError
from dikbench.problem import Drawn, Range, Robot
from dikbench.scenario import (
    Case,
    Claim,
    NamedRobotFamily,
    Perturbation,
    Variation,
    joint_oracle,
    joint_path,
    there_and_back,
    usual_claims,
)
from scenarios.joint_limit_crossing import CROSSINGS

SAMPLES = 201
"""Number of samples of the motion, with one half way, where it is nearest to the limit."""


@dataclass(frozen=True, kw_only=True)
class JointLimitGraze(NamedRobotFamily):
    """A path on which one joint comes within `gap` of its limit and turns back: it can be done.

    The joint j of `joint-limit-crossing` moves as
    q_j(t) = q_max,j - approach + (approach - gap) sin^2(pi t/T), the others rest, and the task
    frame follows: this motion keeps every limit by the clock. A formulation that keeps away from
    limits by more than the gap leaves the path, one that brakes too late is outside. A seed moves
    the other joints by up to 0.1 rad and changes the duration by up to 10 %.

    Provokes: a joint that comes close to its limit, at speed, and must turn back in time

    Shows in: position_violation_max_rad, position_error_max_m, velocity_peak_ratio

    Attributes:
        robot: a robot of `joint-limit-crossing`.
        gap: smallest distance to the limit.
        approach: distance of the start from the limit.
        speed: peak speed of the joint over its limit.

    Source: by construction; limits as in Flacco, De Luca & Khatib 2015.
    """

    robot: Literal["ur5", "panda", "ur3", "ur10", "xarm7", "tiago", "talos", "lwr", "planar3r"] = (
        "ur5"
    )
    gap: Annotated[float, Range(0.001, 0.05, "rad"), Drawn(0.001, 0.05, log=True)] = 0.01
    approach: Annotated[float, Range(0.1, 1.0, "rad"), Drawn(0.2, 0.6)] = 0.4
    speed: Annotated[float, Range(0.05, 0.9), Drawn(0.2, 0.8)] = 0.5

    variation = Variation(start=0.1, timing=0.1)
    outruns_sampling = True
    about_position_limits = True

    def case(self, robot: Robot, change: Perturbation) -> Case:
        """See `Family`."""
        position, velocity = robot.limits.position, robot.limits.velocity
        if position is None or velocity is None:
            raise DikbenchError(f"robot {self.robot} has no position limits")
        where = CROSSINGS[self.robot]
        j = where.joint
        start = change.posture(robot, np.array(where.posture), (j,)).copy()
        start[j] = position.upper[j] - self.approach
        offset = np.zeros(robot.nv)
        offset[j] = self.approach - self.gap
        peak = self.speed / change.pace
        duration = pi * offset[j] / (peak * velocity.upper[j])
        q_r, v_r = there_and_back(robot, start, offset, duration)
        motion = joint_oracle(robot, q_r, np.linspace(0.0, duration, SAMPLES))
        nearest = motion.margin.min()
        claims = (
            Claim("position margin at the start [rad]", motion.margin[0], 0.9 * self.approach),
            Claim("smallest margin [rad]", nearest, 0.9 * self.gap, 1.1 * self.gap),
            *usual_claims(motion, sigma_min=0.03, speed=(0.9 * peak, 1.01 * peak)),
        )
        return Case(
            joint_path(robot, q_r, v_r, duration),
            start,
            motion,
            claims,
            v0=v_r(0.0),
            situation="at joint limits",
        )
