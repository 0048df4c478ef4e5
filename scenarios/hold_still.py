"""Hold still for ten seconds at the start, near a singularity or near a limit."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from math import inf, pi
from types import MappingProxyType
from typing import Annotated, Literal

import numpy as np

from dikbench.errors import DikbenchError
from dikbench.problem import Array, Drawn, Robot
from dikbench.scenario import (
    Case,
    Claim,
    Family,
    Perturbation,
    Situation,
    Variation,
    joint_oracle,
    placement_of,
    samples,
    target_at_rest,
)
from scenarios.singular_postures import PANDA_STRETCHED_RAD

DURATION_S = 10.0

NEAR_RAD = 0.003
"""Distance of a joint from a singularity or its limit, which noise can exceed."""


@dataclass(frozen=True)
class Postures:
    """The postures of a robot.

    Attributes:
        singular: a posture next to a singularity [rad].
        fixed: the joints (indices into v) that make it singular, which a seed does not move.
        joint: the joint next to its upper limit; the others are as at the start.
    """

    singular: tuple[float, ...]
    fixed: tuple[int, ...]
    joint: int


_PANDA = (0.0, 0.3, 0.0, PANDA_STRETCHED_RAD - NEAR_RAD, 0.0, 1.6, pi / 4)
_UR = Postures((0.3, -1.2, 1.4, -1.0, NEAR_RAD, 0.2), (4,), 0)

POSTURES: Mapping[str, Postures] = MappingProxyType(
    {
        "panda": Postures(_PANDA, (2, 3, 4), 5),
        "ur3": _UR,
        "ur5": _UR,
        "ur10": _UR,
    }
)

SITUATIONS: Mapping[str, Situation] = MappingProxyType(
    {"start": "free space", "singular": "near singularities", "limit": "at joint limits"}
)
"""What is difficult about a posture."""

RANGES: Mapping[str, tuple[tuple[float, float], tuple[float, float]]] = MappingProxyType(
    {
        "start": ((0.08, inf), (0.3, inf)),
        "singular": ((1e-4, 2e-3), (0.3, inf)),
        "limit": ((0.08, inf), (0.9 * NEAR_RAD, 1.1 * NEAR_RAD)),
    }
)
"""Ranges of the smallest singular value (m, rad) and of the position margin [rad], by posture."""


@dataclass(frozen=True, kw_only=True)
class HoldStill(Family):
    """Hold the pose of the start for 10 s: any motion comes from the formulation.

    At the robot's start, or with a joint 0.003 rad from a singularity (a UR's wrist, the Panda's
    elbow) or from its limit. With an exact measurement every formulation stands still. Noise on q
    (`ideal[noise=0.003]`) gives an error in the range of J, which a singularity farther away than
    the noise does not amplify; one as near does, at second order, and a limit as near seems to be
    violated. A seed moves the other joints by up to 0.1 rad.

    Provokes: drift and chatter, given a plant with noise or delay

    Shows in: velocity_peak_ratio, joint_travel_rad, direction_error_max_rad

    Attributes:
        robot: one of these robots.
        posture: the posture that is held.

    Source: by construction; why damping: Wampler 1986, Nakamura & Hanafusa 1986.
    """

    robot: Literal["panda", "ur3", "ur5", "ur10"] = "panda"
    frame: None = None
    posture: Annotated[Literal["start", "singular", "limit"], Drawn()] = "start"

    variation = Variation(start=0.1)
    tolerance_m = 0.001

    def case(self, robot: Robot, change: Perturbation) -> Case:
        """See `Family`."""
        q0 = self._posture(robot, change)
        motion = joint_oracle(robot, lambda tau: q0, samples(DURATION_S, self.dt, most=2))
        sigma_min, margin = RANGES[self.posture]
        claims = (
            Claim("smallest singular value (m, rad)", motion.sigma_min.min(), *sigma_min),
            Claim("position margin [rad]", motion.margin.min(), *margin),
        )
        reference = target_at_rest(placement_of(robot, q0), DURATION_S)
        situation = SITUATIONS[self.posture]
        return Case(reference, q0, motion, claims, v0=np.zeros(robot.nv), situation=situation)

    def _posture(self, robot: Robot, change: Perturbation) -> Array:
        where = POSTURES[self.robot]
        if self.posture == "singular":
            return change.posture(robot, np.array(where.singular), where.fixed)
        q0 = change.posture(robot, robot.q0)
        if self.posture == "limit":
            position = robot.limits.position
            if position is None:
                raise DikbenchError(f"robot {robot.name} has no position limits")
            q0 = q0.copy()
            q0[where.joint] = position.upper[where.joint] - NEAR_RAD
        return q0
