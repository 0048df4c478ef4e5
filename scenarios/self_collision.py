"""A path whose exact joint motion brings the arm into itself and back."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from itertools import islice
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

MARGINS_M = (MARGIN_M, 0.012, 0.014, 0.017, 0.02, 0.007, 0.005, 0.003)
"""Distances to keep that are tried of a robot that is not known, one of which its start keeps."""

DEPTH_M = 0.02
"""Smallest depth of the middle posture."""

DEEPEST_M = 0.09
"""Largest depth of a displacement that is tried."""

SIGMA_MIN = 0.045
POSITION_MARGIN_RAD = 0.12
"""Smallest singular value (m, rad) and distance from a limit of one, a little above the claims'."""

DRAWN = 3000
"""Displacements that are tried of a robot of which none is known."""

ROUNDS = 10
"""Rounds in which they are looked at, so that an early one is found soon."""

TRIED = 20
"""Largest number of motions among them that are followed exactly."""

CHOSEN_SHARE = 0.5
"""Share of the joints that one of them moves."""

FARTHEST_RAD = 2.5
"""Largest displacement of a joint among them."""


@dataclass(frozen=True, kw_only=True)
class SelfCollision(Family):
    """A path whose exact joint motion brings the arm into itself and back.

    The joints move as q(t) = q_0 + sin^2(pi t/T) d and the task frame follows: the hand enters the
    base (panda, xarm7, tiago), the upper arm (ur3, ur5, ur10, kinova) or the chest (talos) by more
    than 0.02 m half way; for any other robot d is the first of a fixed list that brings a body of
    the arm into another one, and the margin is one that its start keeps. Distances are those of
    capsules around the meshes (see `dikbench.robots.collision.bodies`), so that the true bodies may
    still be apart. The margin is 0.01 m. A seed moves the start by up to 0.03 rad per joint and
    changes the duration by up to 10 %.

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
            offset, constraint = np.array(DISPLACEMENTS[self.robot]), _constraint(robot, MARGIN_M)
            return self._case(robot, q0, offset, constraint, change)
        check_velocity_limits(robot, "the duration")
        constraint = _clear_at(robot, q0)
        reason = "none brings it in a little, away from limits and singularities"
        for offset in islice(_displacements(robot, q0, constraint), TRIED):
            try:
                case = self._case(robot, q0, offset, constraint, change)
                Certificate(case.claims).check(robot.name)
            except DikbenchError as error:
                reason = f"of the last one that brings it in: {error}"
                continue
            return case
        raise DikbenchError(
            f"no path of robot {robot.name} from its start into itself and back is found, of "
            f"{DRAWN} that were tried: {reason}"
        )

    def _case(
        self,
        robot: Robot,
        q0: Array,
        offset: Array,
        constraint: CollisionConstraint,
        change: Perturbation,
    ) -> Case:
        at_one_second = joint_path(robot, *there_and_back(robot, q0, offset, 1.0), 1.0)
        duration = duration_at(robot, at_one_second, q0, self.speed, self.dt) * change.pace
        reference = joint_path(robot, *there_and_back(robot, q0, offset, duration), duration)
        motion = self.exact_motion(robot, reference, q0, most=100)
        distance, margin = constraint.distances(robot, motion.q), constraint.margin
        claims = collision_claims(motion, distance, margin, depth=DEPTH_M, speed=self.speed)
        return Case(reference, q0, motion, claims, constraints=(constraint,))


def _constraint(robot: Robot, margin: float) -> CollisionConstraint:
    return CollisionConstraint(margin=margin, influence=influence_distance(robot))


def _clear_at(robot: Robot, q0: Array) -> CollisionConstraint:
    """Return the constraint with the first of `MARGINS_M` that q0 (nq,) keeps by far.

    Bodies of a URDF without an SRDF may be near each other at any configuration, by a distance that
    is just above a margin; those that are nearer are left out.

    Raises:
        DikbenchError: if it keeps none.
    """
    for margin in MARGINS_M:
        constraint = _constraint(robot, margin)
        if constraint.distances(robot, q0[None])[0] >= 1.5 * margin:
            return constraint
    raise DikbenchError(f"robot {robot.name}: bodies of its arm are near each other at its start")


def _displacements(robot: Robot, q0: Array, constraint: CollisionConstraint) -> Iterator[Array]:
    """Yield displacements (nv,) into the arm that meet no limit and no singularity.

    The middle posture is looked at first, then those on the way to it.
    """
    random, shape = np.random.default_rng(0), (DRAWN // ROUNDS, len(robot.chain))
    for _ in range(ROUNDS):
        # Of a few joints at a time, as the known ones are.
        chosen = random.uniform(size=shape) < CHOSEN_SHARE
        drawn = np.zeros((len(chosen), robot.nv))
        drawn[:, robot.chain] = chosen * random.uniform(-FARTHEST_RAD, FARTHEST_RAD, shape)
        drawn *= robot.joint_scale
        middles = np.array([pin.integrate(robot.model, q0, offset) for offset in drawn])
        inside = [position_margin(robot, q) >= POSITION_MARGIN_RAD for q in middles]
        drawn, middles = drawn[inside], middles[inside]
        depths = -constraint.distances(robot, middles) if len(middles) else np.zeros(0)
        for offset in drawn[(depths >= 1.1 * DEPTH_M) & (depths <= DEEPEST_M)]:
            way, _ = there_and_back(robot, q0, offset, 1.0)
            if joint_oracle(robot, way, np.linspace(0.0, 0.5, 11)).sigma_min.min() >= SIGMA_MIN:
                yield offset
