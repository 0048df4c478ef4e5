"""A goal whose shortest path leads out of a joint's range, while the long path is free."""

from __future__ import annotations

from dataclasses import dataclass
from math import pi
from typing import Annotated, Literal

import numpy as np
import pinocchio as pin

from dikbench.problem import Array, Drawn, Range, Robot
from dikbench.scenario import (
    Case,
    Claim,
    NamedRobotFamily,
    Perturbation,
    Variation,
    joint_oracle,
    placement_of,
    samples,
    target_at_rest,
)

PEAK_SPEED_SHARE = 0.8
"""Peak speed of the long path over the velocity limit."""


@dataclass(frozen=True, kw_only=True)
class GreedyTrap(NamedRobotFamily):
    """A local minimum by design: one joint with limits 0 and 2 pi, its goal the other way round.

    From q = start the orientation of q = goal is nearer through 0, where the limit is, than through
    pi: a formulation that follows the error gets stuck at 0, whatever its parameters. The long path
    reaches the goal inside all limits: start + (goal - start) sin^2(pi t/(2 T)). A seed moves
    the start by up to 0.2 rad and the goal by up to 0.2 rad.

    Provokes: a local minimum, in which every formulation that follows the error gets stuck

    Shows in: orientation_error_final_rad, stuck_share

    Attributes:
        start: start of the joint.
        goal: goal of the joint.

    Source: by construction; the limits of every greedy method.
    """

    robot: Literal["planar1r"] = "planar1r"
    gain: float = 2.0
    start: Annotated[float, Range(0.3, 1.2, "rad"), Drawn(0.4, 1.0)] = 0.5
    goal: Annotated[float, Range(4.9, 6.0, "rad"), Drawn(5.1, 5.8)] = 5.5

    variation = Variation(start=0.2, direction=0.2)
    judged = "end"

    def case(self, robot: Robot, change: Perturbation) -> Case:
        """See `Family`."""
        q0 = change.posture(robot, np.array([self.start]))
        turned = self.goal + float(pin.log3(change.rotation(robot))[2])
        assert robot.limits.velocity is not None
        offset = turned - q0
        fastest = PEAK_SPEED_SHARE * float(robot.limits.velocity.upper[0])
        duration = pi * float(offset[0]) / (2 * fastest)

        def long_path(tau: float) -> Array:
            q: Array = q0 + offset * np.sin(pi / 2 * min(tau / duration, 1.0)) ** 2
            return q

        motion = joint_oracle(robot, long_path, samples(duration, self.dt))
        target = placement_of(robot, np.array([turned]))
        shortest = float(pin.log3(placement_of(robot, q0).rotation.T @ target.rotation)[2])
        end = q0[0] + shortest
        claims = (
            Claim("end of the shortest way, past a limit at 0 [rad]", end, -pi, -0.05),
            Claim("position margin of the way round [rad]", motion.margin.min(), at_least=0.05),
        )
        return Case(
            target_at_rest(target, duration),
            q0,
            motion,
            claims,
            v0=np.zeros(1),
            situation="at joint limits",
        )
