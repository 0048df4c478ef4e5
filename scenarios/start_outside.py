"""A start a little outside a position limit."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from types import MappingProxyType
from typing import Annotated, Literal

import numpy as np

from dikbench.problem import Drawn, Range, Robot
from dikbench.scenario import (
    Case,
    Claim,
    NamedRobotFamily,
    Perturbation,
    Time,
    Variation,
    at_constant_rate,
    joint_oracle,
    joint_path,
    least_norm_share,
    samples,
    secondary_tasks,
    usual_claims,
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
"""The joint (index into v) that is outside its upper limit; the null space does not move it."""


@dataclass(frozen=True, kw_only=True)
class StartOutside(NamedRobotFamily):
    """A start outside a position limit, as after a push or a calibration, and a slow way inside.

    One joint stands `outside` beyond its upper limit, the others as at the robot's start; the task
    frame follows q_j(t) = q_max,j + outside - rate t, which is inside after outside/rate seconds.
    With a rate of 0 the frame is to rest, and only a direction error leads inside. Many programs
    have no feasible point here: libraries raise errors, stop or move out. A seed moves
    the other joints by up to 0.05 rad and changes the rate by up to 10 %.

    Provokes: programs without a feasible point, and too fast ways back

    Shows in: infeasible_share, position_violation_max_rad, velocity_peak_ratio

    Attributes:
        robot: one of these robots.
        outside: distance of the start from the limit.
        rate: speed of the joint towards the inside.
        duration: duration of the run.

    Source: by construction; a question of users of Pink and PlaCo.
    """

    robot: Literal[
        "ur5", "ur3", "ur10", "panda", "xarm7", "kinova", "tiago", "talos", "planar3r"
    ] = "ur5"
    outside: Annotated[float, Range(1e-4, 1e-2, "rad"), Drawn(5e-4, 1e-2, log=True)] = 5e-3
    rate: Annotated[float, Range(0.0, 0.5, "rad/s"), Drawn(0.02, 0.2)] = 0.05
    duration: Time = 2.0

    variation = Variation(start=0.05, timing=0.1)
    tolerance_m = 0.002
    about_position_limits = True

    def case(self, robot: Robot, change: Perturbation) -> Case:
        """See `Family`."""
        j = JOINTS[self.robot]
        assert robot.limits.position is not None
        start = change.posture(robot, robot.q0, (j,)).copy()
        start[robot.limits.q_index[j]] = robot.limits.position.upper[j] + self.outside
        inward = np.zeros(robot.nv)
        inward[j] = -self.rate / change.pace
        q_r, v_r = at_constant_rate(robot, start, inward)
        motion = joint_oracle(robot, q_r, samples(self.duration, self.dt))
        travel = self.duration * self.rate / change.pace
        inside = motion.margin[-1] - motion.margin[0]
        share = least_norm_share(robot, motion.q, j)
        claims = (
            Claim("margin at the start [rad]", motion.margin[0], -1.001e-2, -0.99e-4),
            Claim("way towards the inside [rad]", inside, 0.99 * min(travel, 0.1), travel + 1e-9),
            Claim("its share in the least-norm motion", share, 0.8),
            *usual_claims(motion, sigma_min=0.03),
            *usual_claims(motion, speed=(-np.inf, 0.9)),
        )
        return Case(
            joint_path(robot, q_r, v_r, self.duration),
            start,
            motion,
            claims,
            v0=inward.copy(),
            tasks=secondary_tasks(robot, robot.q0),
        )
