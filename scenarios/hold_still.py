"""Hold still for ten seconds, where that is easy and where it is not."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from math import atan, inf, pi
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
    Variation,
    joint_oracle,
    placement_of,
    samples,
    target_at_rest,
)

DURATION = 10.0

NEAR = 0.003
"""How far from a singularity or inside its limit a joint stands [rad]: noise makes up for it."""

STRETCHED = -(atan(0.0825 / 0.316) + atan(0.0825 / 0.384))
"""Where the Panda's elbow is [rad]: lengths of its arm, offsets of its elbow [m]."""


@dataclass(frozen=True)
class Postures:
    """Where a robot can stand.

    Attributes:
        singular: a posture next to a singularity [rad].
        fixed: the joints (indices into v) that put it there, which a seed leaves alone.
        joint: the joint that stands next to its upper limit, the others as at the start.
    """

    singular: tuple[float, ...]
    fixed: tuple[int, ...]
    joint: int


_UR = Postures((0.3, -1.2, 1.4, -1.0, NEAR, 0.2), (4,), 0)

POSTURES: Mapping[str, Postures] = MappingProxyType(
    {
        "panda": Postures((0.0, 0.3, 0.0, STRETCHED - NEAR, 0.0, 1.6, pi / 4), (2, 3, 4), 5),
        "ur3": _UR,
        "ur5": _UR,
        "ur10": _UR,
    }
)

RANGES: Mapping[str, tuple[tuple[float, float], tuple[float, float]]] = MappingProxyType(
    {
        "start": ((0.08, inf), (0.3, inf)),
        "singular": ((1e-4, 2e-3), (0.3, inf)),
        "limit": ((0.08, inf), (0.9 * NEAR, 1.1 * NEAR)),
    }
)
"""Of the smallest singular value (m, rad) and of the position margin [rad], by posture."""


@dataclass(frozen=True, kw_only=True)
class HoldStill(Family):
    """Hold the pose of the start for 10 s: nothing should move, and what does is the law's doing.

    At the robot's start, or with a joint 0.003 rad from a singularity (a UR's wrist, the Panda's
    elbow) or from its limit. Measured exactly, every law stands still. Noise on q
    (`ideal[noise=0.003]`) makes an error that lies in the range of J, which a singularity that is
    farther away than the noise does not magnify; one that is as near does, at second order, and a
    limit that is as near seems to be broken. A seed moves the other joints by up to 0.1 rad.

    Provokes: drift and chatter, given a plant with noise or delay

    Shows in: velocity_peak_ratio, joint_travel_rad, direction_error_max_rad

    Attributes:
        robot: one of these.
        posture: where the robot stands.

    Source: by construction; why damping: Wampler 1986, Nakamura & Hanafusa 1986.
    """

    robot: Literal["panda", "ur3", "ur5", "ur10"] = "panda"
    frame: None = None
    posture: Annotated[Literal["start", "singular", "limit"], Drawn()] = "start"

    variation = Variation(start=0.1)

    def case(self, robot: Robot, change: Perturbation) -> Case:
        """See `Family`."""
        q0 = self._posture(robot, change)
        motion = joint_oracle(robot, lambda tau: q0, samples(DURATION, self.dt, most=2))
        sigma_min, margin = RANGES[self.posture]
        claims = (
            Claim("smallest singular value (m, rad)", motion.sigma_min.min(), *sigma_min),
            Claim("position margin [rad]", motion.margin.min(), *margin),
        )
        reference = target_at_rest(placement_of(robot, q0), DURATION)
        return Case(reference, q0, motion, claims, v0=np.zeros(robot.nv))

    def _posture(self, robot: Robot, change: Perturbation) -> Array:
        where = POSTURES[self.robot]
        if self.posture == "singular":
            return change.posture(robot, np.array(where.singular), where.fixed)
        q0 = change.posture(robot, robot.q0)
        if self.posture == "limit":
            position = robot.limits.position
            if position is None:
                raise DikbenchError(f"robot {robot.name} has no limits")
            q0 = q0.copy()
            q0[where.joint] = position.upper[where.joint] - NEAR
        return q0
