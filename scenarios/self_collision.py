"""A path whose exact joint motion brings the arm into itself and back."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from types import MappingProxyType
from typing import Annotated, Literal

import numpy as np

from dikbench.problem import CollisionConstraint, Drawn, Range, Robot
from dikbench.scenario import (
    Case,
    Family,
    Perturbation,
    Variation,
    collision_claims,
    duration_at,
    influence_distance,
    joint_path,
    there_and_back,
)

DISPLACEMENTS: Mapping[str, tuple[float, ...]] = MappingProxyType(
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
"""From the start to a posture in which the arm is inside itself [rad]."""

MARGIN_M = 0.01
"""Distance to keep."""


@dataclass(frozen=True, kw_only=True)
class SelfCollision(Family):
    """A path whose exact joint motion brings the arm into itself and back.

    The joints move as q(t) = q_0 + sin^2(pi t/T) d and the task frame follows: the hand enters the
    base (panda, xarm7, tiago), the upper arm (ur3, ur5, ur10, kinova) or the chest (talos) by more
    than 0.02 m half way. Distances are those of capsules around the meshes (see
    `dikbench.robots.collision.bodies`), so that the true bodies may still be apart. The
    margin is 0.01 m. A seed moves the start by up to 0.03 rad per joint and changes the duration by
    up to 10 %.

    Provokes: an arm that folds into itself

    Shows in: distance_min_m, distance_violation_max_m, position_error_max_m

    Attributes:
        robot: one of these robots.
        speed: peak of the motion's joint speeds over their limits.

    Source: by construction; Kanoun et al. 2011 (self-collision as rows of a program).
    """

    robot: Literal["panda", "ur3", "ur5", "ur10", "xarm7", "kinova", "tiago", "talos"] = "panda"
    frame: None = None
    speed: Annotated[float, Range(0.05, 0.9), Drawn(0.1, 0.7)] = 0.3

    variation = Variation(start=0.03, timing=0.1)

    def case(self, robot: Robot, change: Perturbation) -> Case:
        """See `Family`."""
        offset, q0 = np.array(DISPLACEMENTS[self.robot]), change.posture(robot, robot.q0)
        at_one_second = joint_path(robot, *there_and_back(robot, q0, offset, 1.0), 1.0)
        duration = duration_at(robot, at_one_second, q0, self.speed, self.dt) * change.pace
        reference = joint_path(robot, *there_and_back(robot, q0, offset, duration), duration)
        motion = self.exact_motion(robot, reference, q0, most=100)
        constraint = CollisionConstraint(margin=MARGIN_M, influence=influence_distance(robot))
        distance = constraint.distances(robot, motion.q)
        claims = collision_claims(motion, distance, MARGIN_M, depth=0.02, speed=self.speed)
        return Case(reference, q0, motion, claims, constraints=(constraint,))
