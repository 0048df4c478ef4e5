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
from dikbench.problem import Array, Drawn, Range, Robot
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


@dataclass(frozen=True)
class Postures:
    """The postures of a robot.

    Attributes:
        singular: a singular posture [rad].
        out: the joint that leads out of the singularity, and to which side.
        fixed: the joints (indices into v) that make it singular, which a seed does not move.
        joint: the joint next to its upper limit; the others are as at the start.
    """

    singular: tuple[float, ...]
    out: tuple[int, float]
    fixed: tuple[int, ...]
    joint: int


_PANDA = (0.0, 0.3, 0.0, PANDA_STRETCHED_RAD, 0.0, 1.6, pi / 4)
_UR = Postures((0.3, -1.2, 1.4, -1.0, 0.0, 0.2), (4, 1.0), (4,), 0)

POSTURES: Mapping[str, Postures] = MappingProxyType(
    {
        "panda": Postures(_PANDA, (3, -1.0), (2, 3, 4), 5),
        "ur3": _UR,
        "ur5": _UR,
        "ur10": _UR,
    }
)

SITUATIONS: Mapping[str, Situation] = MappingProxyType(
    {"start": "free space", "singular": "near singularities", "limit": "at joint limits"}
)
"""What is difficult about a posture."""

SINGULAR = (1 / 30, 2 / 3)
AT_LIMIT = (0.9, 1.1)
"""Smallest singular value and position margin, over the distance."""

KNOWN = (0.08, 0.3)
"""Smallest singular value (m, rad) and position margin [rad] where they are not what is difficult,
of the robots whose postures are known."""

ANY = (0.02, 0.05)
"""The same of any other robot: far from what noise can reach."""


@dataclass(frozen=True, kw_only=True)
class HoldStill(Family):
    """Hold the pose of the start for 10 s: any motion comes from the formulation.

    At the robot's start, or with a joint `distance` from a singularity (a UR's wrist, the Panda's
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
        distance: of a joint from the singularity, or from its limit.

    Source: by construction; why damping: Wampler 1986, Nakamura & Hanafusa 1986.
    """

    posture: Annotated[Literal["start", "singular", "limit"], Drawn()] = "start"
    distance: Annotated[
        float, Range(above=0.0, high=0.02, unit="rad"), Drawn(1e-3, 0.01, log=True)
    ] = 0.003

    robots = (*POSTURES, "xarm7", "kinova", "tiago", "talos", "lwr")
    variation = Variation(start=0.1)
    tolerance_m = 0.001

    def case(self, robot: Robot, change: Perturbation) -> Case:
        """See `Family`."""
        if self.robot in POSTURES and self.as_catalogued:
            q0 = self._known_posture(robot, change)
            return self._case(robot, q0, KNOWN)
        reason = "no singular posture inside the position limits"
        if self.posture == "limit":
            reason = "no joint has a limit"
        for q0 in self._postures(robot, change):
            case = self._case(robot, q0, ANY)
            try:
                Certificate(case.claims).check(robot.name)
            except CertificateFailed as error:
                reason = f"of the last one tried, {error.failures}"
                continue
            return case
        raise DikbenchError(f"robot {robot.name} has no posture={self.posture}: {reason}")

    def _case(self, robot: Robot, q0: Array, easy: tuple[float, float]) -> Case:
        motion = joint_oracle(robot, lambda tau: q0, samples(DURATION_S, self.dt, most=2))
        sigma_min, margin = ((least, inf) for least in easy)
        if self.posture == "singular":
            sigma_min = (SINGULAR[0] * self.distance, SINGULAR[1] * self.distance)
        elif self.posture == "limit":
            margin = (AT_LIMIT[0] * self.distance, AT_LIMIT[1] * self.distance)
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
            joint, side = where.out
            singular = np.array(where.singular)
            singular[joint] += side * self.distance
            return change.posture(robot, singular, where.fixed)
        q0 = change.posture(robot, robot.q0)
        if self.posture == "limit":
            position = robot.limits.position
            if position is None:
                raise DikbenchError(f"robot {robot.name} has no position limits")
            q0 = q0.copy()
            q0[where.joint] = position.upper[where.joint] - self.distance
        return q0

    def _postures(self, robot: Robot, change: Perturbation) -> Iterator[Array]:
        """Yield the postures (nq,) to try of a robot of which none is known."""
        start = change.posture(robot, robot.q0)
        if self.posture == "start":
            yield start
        elif self.posture == "limit":
            yield from _at_limits(robot, start, self.distance)
        else:
            yield from _near_singularities(robot, change, self.distance)


def _at_limits(robot: Robot, start: Array, distance: float) -> Iterator[Array]:
    """Yield a configuration with one joint near its limit: at upper limits, then at lower ones."""
    limits = robot.limits
    if limits.position is None:
        return
    near = distance * robot.joint_scale
    for bound, inward in ((limits.position.upper, -near), (limits.position.lower, near)):
        for k in robot.chain:
            if np.isfinite(bound[k]):
                q = start.copy()
                q[limits.q_index[k]] = bound[k] + inward[k]
                yield q


def _near_singularities(robot: Robot, change: Perturbation, distance: float) -> Iterator[Array]:
    """Yield configurations next to singular ones, on either side."""
    for found in singular_postures(robot, ANY[1] + distance):
        try:
            moved = change.posture(robot, found)
            where = analyse(robot, found if moved is found else make_singular(robot, moved))
        except DikbenchError:  # it loses two directions
            continue
        out = int(np.argmax(where.growth))
        # The smallest singular value grows to a half of what is claimed, at most.
        step = distance * min(1.0, SINGULAR[1] / 2 / max(where.growth[out], SINGULAR[0]))
        for side in (step, -step):
            yield pin.integrate(robot.model, where.q, side * np.eye(robot.nv)[out])
