"""A step to a target far away and far turned."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from types import MappingProxyType
from typing import Annotated, Literal

import numpy as np
import pinocchio as pin

from dikbench.problem import Drawn, Range, Robot
from dikbench.scenario import (
    Case,
    Claim,
    Family,
    Perturbation,
    Time,
    Variation,
    from_rest_to_rest,
    motion_of_a_step,
    placement_of,
    step_claims,
    target_at_rest,
)

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
"""Directions of the displacement and of the rotation axis, in the task frame at the start; on the
screw there the arm meets neither a limit nor a singularity."""

SMALLEST_FIRST_SPEED = 0.1
"""Smallest initial speed over the limits that a step requires, per gain [1/s] and angle [rad]."""


@dataclass(frozen=True, kw_only=True)
class Step(Family):
    """A step to a target far away and far turned: the first commands are too fast.

    X_d = (R exp3(angle a), p + distance R d), from the first instant on, with a and d unit vectors
    in the axes of the frame, chosen for each robot such that the screw
    X exp6(s log6(X^-1 X_d)) is free. A formulation without limits starts at gain times the error. A
    seed moves the start by up to 0.1 rad per joint and turns a and d by up to 0.2 rad.

    Provokes: an error that requires joint speeds beyond the limits at once

    Shows in: direction_error_max_rad, velocity_violation_max_rad_s, progress_min

    Attributes:
        robot: one of the arms in space.
        distance: distance of the target.
        angle: angle of the target.
        duration: duration of the run.

    Source: step response; the screw: Lynch & Park, Modern Robotics, 2017.
    """

    robot: Literal["panda", "ur3", "ur5", "ur10", "xarm7", "kinova", "tiago", "talos"] = "panda"
    frame: None = None
    distance: Annotated[float, Range(0.05, 0.3, "m"), Drawn(0.1, 0.25)] = 0.2
    angle: Annotated[float, Range(0.5, 2.62, "rad"), Drawn(1.0, 2.0)] = 1.5
    duration: Time = 4.0

    variation = Variation(start=0.1, direction=0.2)

    def case(self, robot: Robot, change: Perturbation) -> Case:
        """See `Family`."""
        q0 = change.posture(robot, robot.q0)
        start = placement_of(robot, q0)
        d, a = (
            change.rotation(robot) @ (np.array(direction) / np.linalg.norm(direction))
            for direction in DIRECTIONS[self.robot]
        )
        away = start.translation + self.distance * start.rotation @ d
        target = pin.SE3(start.rotation @ pin.exp3(self.angle * a), away)
        way = motion_of_a_step(robot, q0, pin.log6(start.actInv(target)).np, self.gain)
        least = SMALLEST_FIRST_SPEED * self.gain * self.angle
        claims = (*step_claims(way), Claim("first speed over limit", way.speed_ratio[0], least))
        witness = from_rest_to_rest(robot, way, 0.8 * self.duration)
        return Case(target_at_rest(target, self.duration), q0, None, claims, witness=witness)
