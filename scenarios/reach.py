"""A step to a target nearby, far from every limit and singularity."""

from __future__ import annotations

from dataclasses import dataclass
from math import pi
from typing import Annotated

import numpy as np
import pinocchio as pin

from dikbench.problem import Drawn, Range, Robot
from dikbench.scenario import (
    Case,
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


@dataclass(frozen=True, kw_only=True)
class Reach(Family):
    """A step to a target nearby: the easy case.

    The target is `distance` [m] and `angle` [rad] away from the start, along the body axis
    (-1, 1, -1)/sqrt(3) and about it; for a planar arm, along (-1, 1)/sqrt(2) and clockwise. A seed
    turns the axis, and moves the start by up to 0.1 rad per joint.

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

    robots = ("panda", "ur3", "ur5", "ur10", "xarm7", "talos", "planar3r", "planar4r")
    variation = Variation(start=0.1, direction=pi)

    def case(self, robot: Robot, change: Perturbation) -> Case:
        """See `Family`."""
        q0 = change.posture(robot, robot.q0)
        axis = change.rotation(robot) @ np.array([-1.0, 1.0, -1.0])
        start, rows = placement_of(robot, q0), list(robot.task_rows)
        twist = body_twist(robot, start, np.concatenate([axis, axis])[rows])
        for part, size in ((twist[:3], self.distance), (twist[3:], self.angle)):
            if part.any():  # only what is asked for
                part *= size / np.linalg.norm(part)
        target = start * pin.exp6(pin.Motion(twist))
        way = motion_of_a_step(robot, q0, twist, self.gain)
        claims = (*step_claims(way), *usual_claims(way, speed=(-np.inf, 0.9)))
        witness = from_rest_to_rest(robot, way, 0.8 * self.duration)
        return Case(target_at_rest(target, self.duration), q0, None, claims, witness=witness)
