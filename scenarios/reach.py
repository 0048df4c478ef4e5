"""A step to a target nearby, far from every limit and singularity."""

from __future__ import annotations

from dataclasses import dataclass
from math import pi
from typing import Annotated

import numpy as np
import pinocchio as pin

from dikbench.problem import Drawn, PoseTask, Range, Robot
from dikbench.scenario import (
    Case,
    Claim,
    Family,
    Perturbation,
    Time,
    Variation,
    body_twist,
    from_rest_to_rest,
    motion_of_a_step,
    placement_of,
    step_claims,
    target_at_rest,
    usual_claims,
)

FASTEST = 0.9
"""Largest joint speed over its limit that the gain may ask for."""

LOWEST_GAIN = 0.1
"""Smallest share of the default gain that a slow arm may have."""


@dataclass(frozen=True, kw_only=True)
class Reach(Family):
    """A step to a target nearby: the easy case.

    The target is `distance` [m] and `angle` [rad] away from the start, along the body axis
    (-1, 1, -1)/sqrt(3) and about it; for a planar arm, along (-1, 1)/sqrt(2) and clockwise. Where
    the default gain asks a robot that is not in the catalogue for more than 0.9 of its speed
    limits, the gain is as much lower and the run as much longer, up to ten times. A seed turns the
    axis, and moves the start by up to 0.1 rad per joint.

    Provokes: nothing; a formulation that fails here fails everywhere

    Shows in: position_error_final_m, orientation_error_final_rad

    Attributes:
        distance: distance of the target.
        angle: angle of the target.
        duration: duration of the run.

    Source: step response.
    """

    gain: float = 2.0
    distance: Annotated[float, Range(0.01, 0.3, "m"), Drawn(0.02, 0.15)] = 0.1
    angle: Annotated[float, Range(0.0, 1.5, "rad"), Drawn(0.05, 0.5)] = 0.3
    duration: Time = 2.5

    robots = (
        "panda", "ur3", "ur5", "ur10", "xarm7", "talos", "tiago", "lwr", "planar3r", "planar4r",
    )  # fmt: skip
    variation = Variation(start=0.1, direction=pi)

    def case(self, robot: Robot, change: Perturbation) -> Case:
        """See `Family`."""
        q0 = change.posture(robot, robot.q0)
        axis = change.rotation(robot) @ np.array([-1.0, 1.0, -1.0])
        wanted, start = np.zeros(6), placement_of(robot, q0)
        rows = list(robot.task_rows)
        wanted[rows] = np.concatenate([axis, axis])[rows]  # only what the arm is asked for
        for part, length in ((wanted[:3], self.distance), (wanted[3:], self.angle)):
            np.multiply(part, length / (float(np.linalg.norm(part)) or 1.0), out=part)
        twist = body_twist(robot, start, wanted[rows])
        gain, duration = self.gain, self.duration
        way = motion_of_a_step(robot, q0, twist, gain)
        claims: tuple[Claim, ...] = ()
        if gain == Reach.gain and not self.as_catalogued and way.peak_speed_ratio > FASTEST:
            share = 0.999 * FASTEST / way.peak_speed_ratio
            gain, duration = gain * share, duration / share
            way = motion_of_a_step(robot, q0, twist, gain)
            claims = (Claim("gain over the default", share, at_least=LOWEST_GAIN),)
        claims += (*step_claims(way), *usual_claims(way, speed=(-np.inf, FASTEST)))
        return Case(
            target_at_rest(start * pin.exp6(pin.Motion(twist)), duration),
            q0,
            None,
            claims,
            tracking=PoseTask(gain=gain),
            witness=from_rest_to_rest(robot, way, 0.8 * duration),
        )
