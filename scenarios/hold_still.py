"""Hold still for ten seconds at the start, near a singularity or near a limit."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from math import inf, pi
from types import MappingProxyType
from typing import Annotated, Literal

import numpy as np
import pinocchio as pin

from dikbench.errors import DikbenchError
from dikbench.problem import Array, Drawn, Robot
from dikbench.scenario import (
    Case,
    Certificate,
    CertificateFailed,
    Claim,
    Family,
    Perturbation,
    Situation,
    Variation,
    analyse,
    joint_oracle,
    make_singular,
    placement_of,
    samples,
    singular_postures,
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

Ranges = tuple[tuple[float, float], tuple[float, float]]
"""Of the smallest singular value (m, rad) and of the position margin [rad]."""

SINGULAR = (1e-4, 2e-3)
AT_LIMIT = (0.9 * NEAR_RAD, 1.1 * NEAR_RAD)

RANGES: Mapping[str, Ranges] = MappingProxyType(
    {
        "start": ((0.08, inf), (0.3, inf)),
        "singular": (SINGULAR, (0.3, inf)),
        "limit": ((0.08, inf), AT_LIMIT),
    }
)
"""By posture, of the robots whose postures are known."""

ANY_RANGES: Mapping[str, Ranges] = MappingProxyType(
    {
        "start": ((0.02, inf), (0.05, inf)),
        "singular": (SINGULAR, (0.05, inf)),
        "limit": ((0.02, inf), AT_LIMIT),
    }
)
"""By posture, of any other robot: far from what the noise can reach."""


@dataclass(frozen=True, kw_only=True)
class HoldStill(Family):
    """Hold the pose of the start for 10 s: any motion comes from the formulation.

    At the robot's start, or with a joint 0.003 rad from a singularity (a UR's wrist, the Panda's
    elbow) or from its limit. Of any other robot these are the first singular posture found from the
    start outwards, left by the joint that leads out fastest, and the first joint with a limit. With
    an exact measurement every formulation stands still. Noise on q (`ideal[noise=0.003]`) gives an
    error in the range of J, which a singularity farther away than the noise does not amplify; one
    as near does, at second order, and a limit as near seems to be violated. A seed moves the other
    joints by up to 0.1 rad.

    Provokes: drift and chatter, given a plant with noise or delay

    Shows in: velocity_peak_ratio, joint_travel_rad, direction_error_max_rad

    Attributes:
        posture: the posture that is held.

    Source: by construction; why damping: Wampler 1986, Nakamura & Hanafusa 1986.
    """

    posture: Annotated[Literal["start", "singular", "limit"], Drawn()] = "start"

    robots = (*POSTURES, "xarm7", "kinova", "tiago", "talos", "lwr")
    variation = Variation(start=0.1)
    tolerance_m = 0.001

    def case(self, robot: Robot, change: Perturbation) -> Case:
        """See `Family`."""
        if self.robot in POSTURES and self.as_catalogued:
            q0 = self._known_posture(robot, change)
            return self._case(robot, q0, RANGES[self.posture])
        reason = "no singular posture inside the position limits"
        if self.posture == "limit":
            reason = "no joint has a limit"
        for q0 in self._postures(robot, change):
            case = self._case(robot, q0, ANY_RANGES[self.posture])
            try:
                Certificate(case.claims).check(robot.name)
            except CertificateFailed as error:
                reason = f"of the last one tried, {error.failures}"
                continue
            return case
        raise DikbenchError(f"robot {robot.name} has no posture={self.posture}: {reason}")

    def _case(self, robot: Robot, q0: Array, ranges: Ranges) -> Case:
        motion = joint_oracle(robot, lambda tau: q0, samples(DURATION_S, self.dt, most=2))
        sigma_min, margin = ranges
        claims = (
            Claim("smallest singular value (m, rad)", motion.sigma_min.min(), *sigma_min),
            Claim("position margin [rad]", motion.margin.min(), *margin),
        )
        reference = target_at_rest(placement_of(robot, q0), DURATION_S)
        situation = SITUATIONS[self.posture]
        return Case(reference, q0, motion, claims, v0=np.zeros(robot.nv), situation=situation)

    def _known_posture(self, robot: Robot, change: Perturbation) -> Array:
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

    def _postures(self, robot: Robot, change: Perturbation) -> Iterator[Array]:
        """Yield the postures (nq,) to try of a robot of which none is known."""
        start = change.posture(robot, robot.q0)
        if self.posture == "start":
            yield start
        elif self.posture == "limit":
            yield from _at_limits(robot, start)
        else:
            yield from _near_singularities(robot, change)


def _at_limits(robot: Robot, start: Array) -> Iterator[Array]:
    """Yield a configuration with one joint near its limit: at upper limits, then at lower ones."""
    limits = robot.limits
    if limits.position is None:
        return
    near = NEAR_RAD * robot.joint_scale
    for bound, inward in ((limits.position.upper, -near), (limits.position.lower, near)):
        for k in robot.chain:
            if np.isfinite(bound[k]):
                q = start.copy()
                q[limits.q_index[k]] = bound[k] + inward[k]
                yield q


def _near_singularities(robot: Robot, change: Perturbation) -> Iterator[Array]:
    """Yield configurations next to singular ones, on either side."""
    for found in singular_postures(robot, ANY_RANGES["singular"][1][0] + NEAR_RAD):
        try:
            moved = change.posture(robot, found)
            where = analyse(robot, found if moved is found else make_singular(robot, moved))
        except DikbenchError:  # it loses two directions
            continue
        out = int(np.argmax(where.growth))
        # The smallest singular value grows to a half of what is claimed, at most.
        step = min(NEAR_RAD, SINGULAR[1] / 2 / max(where.growth[out], SINGULAR[0]))
        for side in (step, -step):
            yield pin.integrate(robot.model, where.q, side * np.eye(robot.nv)[out])
