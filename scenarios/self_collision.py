"""A path whose exact joint motion brings the arm into itself and back."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from types import MappingProxyType
from typing import Annotated

import numpy as np
import pinocchio as pin

from dikbench.errors import DikbenchError
from dikbench.problem import Array, CollisionConstraint, Drawn, Range, Robot
from dikbench.scenario import (
    Case,
    Certificate,
    Family,
    Perturbation,
    Variation,
    check_velocity_limits,
    collision_claims,
    duration_at,
    influence_distance,
    joint_oracle,
    joint_path,
    position_margin,
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

DEPTH_M = 0.02
"""Smallest depth of the middle posture."""

DEEPEST_M = 0.09
"""Largest depth of a displacement that is tried."""

SIGMA_MIN = 0.05
POSITION_MARGIN_RAD = 0.12
"""Smallest singular value (m, rad) and distance from a limit of one, a little above the claims'."""

DRAWN = 600
"""Displacements that are tried of a robot of which none is known."""

CHOSEN_SHARE = 0.5
"""Share of the joints that one of them moves."""

FARTHEST_RAD = 2.0
"""Largest displacement of a joint among them."""


@dataclass(frozen=True, kw_only=True)
class SelfCollision(Family):
    """A path whose exact joint motion brings the arm into itself and back.

    The joints move as q(t) = q_0 + sin^2(pi t/T) d and the task frame follows: the hand enters the
    base (panda, xarm7, tiago), the upper arm (ur3, ur5, ur10, kinova) or the chest (talos) by more
    than 0.02 m half way; for any other robot d is the first of a fixed list that brings a body of
    the arm into another one. Distances are those of capsules around the meshes (see
    `dikbench.robots.collision.bodies`), so that the true bodies may still be apart. The
    margin is 0.01 m. A seed moves the start by up to 0.03 rad per joint and changes the duration by
    up to 10 %.

    Provokes: an arm that folds into itself

    Shows in: distance_min_m, distance_violation_max_m, position_error_max_m

    Attributes:
        speed: peak of the motion's joint speeds over their limits.

    Source: by construction; Kanoun et al. 2011 (self-collision as rows of a program).
    """

    speed: Annotated[float, Range(0.05, 0.9), Drawn(0.1, 0.7)] = 0.3

    robots = tuple(DISPLACEMENTS)
    variation = Variation(start=0.03, timing=0.1)

    def case(self, robot: Robot, change: Perturbation) -> Case:
        """See `Family`."""
        q0 = change.posture(robot, robot.q0)
        if self.robot in DISPLACEMENTS and self.as_catalogued:
            return self._case(robot, q0, np.array(DISPLACEMENTS[self.robot]), change)
        check_velocity_limits(robot, "the duration")
        reason = "none brings the arm into itself inside the position limits"
        for offset in self._displacements(robot, q0):
            try:
                case = self._case(robot, q0, offset, change)
                Certificate(case.claims).check(robot.name)
            except DikbenchError as error:
                reason = f"the last one that does: {error}"
                continue
            return case
        raise DikbenchError(
            f"no displacement of robot {robot.name} from its start, of {DRAWN} that were tried, is "
            f"a path into itself and back: {reason}"
        )

    def _case(self, robot: Robot, q0: Array, offset: Array, change: Perturbation) -> Case:
        at_one_second = joint_path(robot, *there_and_back(robot, q0, offset, 1.0), 1.0)
        duration = duration_at(robot, at_one_second, q0, self.speed, self.dt) * change.pace
        reference = joint_path(robot, *there_and_back(robot, q0, offset, duration), duration)
        motion = self.exact_motion(robot, reference, q0, most=100)
        constraint = _constraint(robot)
        distance = constraint.distances(robot, motion.q)
        claims = collision_claims(motion, distance, MARGIN_M, depth=DEPTH_M, speed=self.speed)
        return Case(reference, q0, motion, claims, constraints=(constraint,))

    def _displacements(self, robot: Robot, q0: Array) -> Iterator[Array]:
        """Yield displacements (nv,) to inside of the arm that meet no limit and no singularity.

        The middle posture is looked at first, then those on the way to it.
        """
        constraint, random = _constraint(robot), np.random.default_rng(0)
        # Of a few joints at a time, as the known ones are.
        chosen = random.uniform(size=(DRAWN, len(robot.chain))) < CHOSEN_SHARE
        drawn = np.zeros((DRAWN, robot.nv))
        drawn[:, robot.chain] = chosen * random.uniform(-FARTHEST_RAD, FARTHEST_RAD, chosen.shape)
        drawn *= robot.joint_scale
        middles = np.array([pin.integrate(robot.model, q0, offset) for offset in drawn])
        kept = [position_margin(robot, q) >= POSITION_MARGIN_RAD for q in middles]
        drawn, middles = drawn[kept], middles[kept]
        if not len(middles):
            return
        depth = -constraint.distances(robot, middles)
        inside = (depth >= 1.1 * DEPTH_M) & (depth <= DEEPEST_M)
        for offset in drawn[inside]:
            way = joint_oracle(
                robot, there_and_back(robot, q0, offset, 1.0)[0], np.linspace(0.0, 0.5, 11)
            )
            if way.sigma_min.min() >= SIGMA_MIN:
                yield offset


def _constraint(robot: Robot) -> CollisionConstraint:
    return CollisionConstraint(margin=MARGIN_M, influence=influence_distance(robot))
