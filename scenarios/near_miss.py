"""A path that passes a singularity at a chosen distance and speed, on any arm."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from functools import lru_cache
from types import MappingProxyType
from typing import Annotated, Literal, NamedTuple

import numpy as np
import pinocchio as pin

from dikbench.errors import DikbenchError
from dikbench.problem import Array, Drawn, Kinematics, PoseTask, Range, Robot
from dikbench.scenario import (
    NEAR_SINGULARITY,
    SINGULAR_NEED,
    Case,
    Certificate,
    Claim,
    Family,
    Kind,
    OracleMotion,
    Perturbation,
    Reference,
    Singularity,
    Variation,
    along_screw,
    analyse,
    at_constant_rate,
    body_twist,
    joint_oracle,
    load_robot,
    make_singular,
    oracle_motion,
    screw_path,
    singular_postures,
    solve_placement,
)
from scenarios.singular_postures import SINGULAR_POSTURES, SingularityName, SingularPosture

POSITION_MARGIN_RAD = 0.05
"""Smallest distance of the motion from a position limit."""

HALF_LENGTHS: Mapping[Kind, tuple[float, ...]] = MappingProxyType(
    {"crossing": (0.3,), "fold": (0.15, 0.08), "saddle": (0.15, 0.08)}
)
"""Half lengths of the path to try where none is known (see `SingularPosture`)."""

CROSSING_MISS = Range(0.001, 0.2, "m; rad", also=(0.0,))
FOLD_MISS = Range(0.002, 0.05, "m; rad")
"""Valid distances from a crossing, and from a fold or a saddle."""

SMALLEST_GROWTH = 0.01
"""Smallest growth of sigma_min (m, rad) per rad of the joint that leads out."""

SAMPLES_PER_SIDE = 100
"""Samples of the motion on each side of the nearest point."""


class _Passage(NamedTuple):
    """A path past a singularity, the motion that follows it, and their claims."""

    reference: Reference
    motion: OracleMotion
    claims: tuple[Claim, ...]


@dataclass(frozen=True, kw_only=True)
class NearMiss(Family):
    """A path that passes a singularity at the distance `miss` and the speed `speed`.

    At the singular posture q_s, X_s is the placement, J = U S V^T the body Jacobian (m, rad) and
    n = u_m the lost twist. A crossing (the wrist of a six-axis arm) is passed along a single
    joint's motion d: X(s) = X_s exp6(miss n) exp6(s J d), s in [-s0, s0], n with its largest
    component negative unless only the other side can be followed; the required joint speed grows as
    speed/miss, while miss = 0 requires the single joint's own speed. A fold (an elbow) or a
    saddle (shoulder and wrist of a seven-axis arm) is touched along n from the side to which the
    arm bends: X(s) = X_s exp6((miss + |s|) n), and the speed grows as speed/sqrt(miss). See
    `dikbench.scenario.singularity` for how they are distinguished. A seed moves the joints of the
    posture from which q_s is solved by up to 0.1 rad, and changes the speed by up to 10 %.

    Provokes: joint speeds beyond the limits near a singularity

    Shows in: velocity_peak_ratio, direction_error_max_rad, progress_min

    Attributes:
        singularity: wrist, elbow or shoulder, where the robot's are known; auto: the first known
            one, else the first one found from the robot's start outwards.
        miss: distance from the singularity along the unit body twist n; at a fold or a saddle
            0.002 to 0.05.
        speed: ds/dt, of the joint (crossing), or along the unit twist n, mostly a translation
            (fold, saddle).

    Source: Nakamura & Hanafusa 1986; Chiaverini, Siciliano & Egeland 1994.
    """

    robot: str = "ur5"
    dt: float = 0.005
    singularity: Annotated[Literal["auto", "wrist", "elbow", "shoulder"], Drawn()] = "auto"
    miss: Annotated[float, CROSSING_MISS, Drawn(0.002, 0.05, log=True)] = 0.02
    speed: Annotated[float, Range(0.02, 3.0, "rad/s; m/s"), Drawn(0.1, 1.5, log=True)] = 0.5

    robots = tuple(SINGULAR_POSTURES)
    variation = Variation(start=0.1, timing=0.1)
    grid = ("miss", "speed")

    def case(self, robot: Robot, change: Perturbation) -> Case:
        """See `Family`."""
        pace = self.speed / change.pace
        # Its known postures are of all its joints and rows.
        changed = self.rows is not None or bool(self.lock)
        name = f"{self.robot} with other rows or joints" if changed else self.robot
        if self.singularity == "auto" and name not in SINGULAR_POSTURES:
            passage = _first_found(robot, self.miss, pace, change)
        else:
            known = _known(name, self.singularity)
            where = _perturbed(robot, _nominal(self.robot, self.frame, known.posture), change)
            passage = _passage(robot, where, self.miss, pace, known.half_length)
        motion = passage.motion
        # At a fold the smallest singular value is about the root of the distance.
        near = self.miss <= NEAR_SINGULARITY or motion.sigma_min.min() < NEAR_SINGULARITY
        limit = robot.limits.velocity
        unlimited = limit is None or bool(np.isinf(limit.upper[robot.chain]).all())
        # Without speed limits no need can be measured, and the distance alone counts.
        singular = near and (unlimited or motion.peak_speed_ratio > SINGULAR_NEED)
        return Case(
            passage.reference,
            motion.q[0],
            motion,
            passage.claims,
            situation="near singularities" if singular else None,
        )


def _known(robot: str, singularity: SingularityName | Literal["auto"]) -> SingularPosture:
    """Return the posture of a name; of `auto`, the robot's first."""
    postures = SINGULAR_POSTURES.get(robot, {})
    if singularity == "auto":
        return next(iter(postures.values()))
    if singularity not in postures:
        valid = ", ".join(["auto", *postures])
        raise DikbenchError(
            f"no {singularity} of robot {robot} is known; valid: singularity={valid}"
        )
    return postures[singularity]


@lru_cache
def _nominal(robot: str, frame: str | None, posture: tuple[float, ...]) -> Singularity:
    """Find the singularity of a robot of the catalogue next to a posture (nv,)."""
    arm = load_robot(robot, frame)
    seeded = pin.integrate(arm.model, pin.neutral(arm.model), np.array(posture))
    return analyse(arm, make_singular(arm, seeded))


def _perturbed(arm: Robot, nominal: Singularity, change: Perturbation) -> Singularity:
    """Find the singularity next to the one that the seed moves."""
    moved = change.posture(arm, nominal.q)
    if moved is nominal.q:
        return nominal
    return analyse(arm, make_singular(arm, moved)).oriented_like(nominal)


def _first_found(arm: Robot, miss: float, speed: float, change: Perturbation) -> _Passage:
    """Pass the first singular posture, from the robot's start outwards, that certifies."""
    reason = "none is inside the position limits"
    for q in singular_postures(arm, 2 * POSITION_MARGIN_RAD):
        try:
            where = _perturbed(arm, analyse(arm, q), change)
        except DikbenchError:  # it loses two directions
            continue
        for half_length in HALF_LENGTHS[where.kind]:
            try:
                passage = _passage(arm, where, miss, speed, half_length)
                Certificate(passage.claims).check(arm.name)
            except DikbenchError as error:
                reason = str(error)
                continue
            return passage
    raise DikbenchError(
        f"no singular posture of robot {arm.name} (frame {arm.frame}) can be "
        f"passed with miss={miss}, speed={speed:.3g}; the last one tried: {reason}"
    )


def _passage(
    arm: Robot, where: Singularity, miss: float, speed: float, half_length: float
) -> _Passage:
    """Find the first path past a singularity that can be followed inside the limits."""
    if where.kind != "crossing":
        FOLD_MISS.check("miss", miss)
    if where.kind == "crossing" and where.growth.max() < SMALLEST_GROWTH:
        raise DikbenchError("no single joint leads out of the singularity")
    if where.kind == "crossing" and miss == 0:
        return _straight_through(arm, where, speed, half_length)
    ways = _crossings if where.kind == "crossing" else _folds
    found: list[_Passage] = []
    reason = ""
    for reference, seed in ways(arm, where, miss, speed, half_length):
        try:
            q0 = solve_placement(arm, reference.placement(0.0), seed)
            instants = _instants(half_length, miss, reference.duration)
            motion = oracle_motion(arm, reference, q0, instants)
        except DikbenchError as error:
            reason = str(error)
            continue
        found.append(_Passage(reference, motion, _claims(arm, where, miss, speed, motion)))
        if motion.margin.min() >= POSITION_MARGIN_RAD:
            return found[-1]
    if not found:
        raise DikbenchError(f"the path cannot be followed: {reason}")
    return max(found, key=lambda passage: float(passage.motion.margin.min()))


def _straight_through(arm: Robot, where: Singularity, speed: float, half_length: float) -> _Passage:
    """Move the single joint that leads out fastest from one side to the other."""
    reference, start = next(_crossings(arm, where, 0.0, speed, half_length))
    q_r, _ = at_constant_rate(arm, start, speed * _way_out(where))
    motion = joint_oracle(arm, q_r, _instants(half_length, 0.0, reference.duration))
    return _Passage(reference, motion, _claims(arm, where, 0.0, speed, motion))


def _way_out(where: Singularity) -> Array:
    """Return the unit velocity (nv,) of the joint along which sigma_min grows fastest."""
    out = np.zeros(len(where.growth))
    out[np.argmax(where.growth)] = 1.0
    return out


def _crossings(
    arm: Robot, where: Singularity, miss: float, speed: float, half_length: float
) -> Iterator[tuple[Reference, Array]]:
    """Yield paths along the joint that leads out fastest, on either side, and seeds."""
    out = _way_out(where)
    twist = body_twist(arm, where.placement, where.jacobian @ out)
    seed = pin.integrate(arm.model, where.q, -half_length * out)
    for side in (1.0, -1.0):
        middle = where.placement * pin.exp6(pin.Motion(side * miss * where.lost))
        yield screw_path(middle, speed * twist, 2 * half_length / speed), seed


def _folds(
    arm: Robot, where: Singularity, miss: float, speed: float, half_length: float
) -> Iterator[tuple[Reference, Array]]:
    """Yield the path from inside to the edge and back, with each of two ways to bend."""
    inward, half = where.inward * where.lost, half_length / speed

    reference = along_screw(
        where.placement,
        inward,
        lambda tau: miss + speed * abs(tau - half),
        lambda tau: speed if tau >= half else -speed,
        2 * half,
    )
    # To second order: curvature z^2 / 2 along n for a motion z of the joints.
    far = np.sqrt(2 * (miss + half_length) / where.curvature)
    for side in (1.0, -1.0):
        bent = side * min(far, 1.0) * where.bend
        yield reference, pin.integrate(arm.model, where.q, bent)


def _instants(half_length: float, miss: float, duration: float) -> Array:
    """Place 201 instants [s], densely about the nearest point, where the speed is high."""
    if miss == 0:
        return np.linspace(0.0, duration, 2 * SAMPLES_PER_SIDE + 1)
    end = np.arcsinh(half_length / miss)
    share = miss / half_length * np.sinh(np.linspace(-end, end, 2 * SAMPLES_PER_SIDE + 1))
    instants: Array = duration / 2 * (1.0 + share)
    instants[0], instants[-1] = 0.0, duration
    return instants


def _claims(
    arm: Robot, where: Singularity, miss: float, speed: float, motion: OracleMotion
) -> tuple[Claim, ...]:
    sigma, peak = motion.sigma_min, float(np.abs(motion.v).max())
    middle = motion.instants[SAMPLES_PER_SIDE]
    aside = abs(motion.instants[np.argmin(sigma)] - middle) / middle
    near = 0.3 + (2 * miss / (speed * middle) if where.kind == "crossing" else 0.0)
    claims = [
        Claim("smallest singular value on the path (m, rad)", sigma.min(), at_most=0.17),
        Claim("where, from the nearest point (0) to the ends (1)", float(aside), at_most=near),
        Claim("its ratio to the largest one", sigma.min() / sigma.max(), at_most=0.7),
        Claim("smallest singular value at the start (m, rad)", sigma[0], at_least=0.02),
        Claim(
            "position margin on the path [rad]", motion.margin.min(), at_least=POSITION_MARGIN_RAD
        ),
    ]
    if where.kind != "crossing":
        # The bend z needs curvature z^2 / 2 = miss: dz/dt = speed / sqrt(2 curvature miss).
        expected = speed / np.sqrt(2 * where.curvature * miss) * float(np.abs(where.bend).max())
        claims.append(Claim("peak joint speed [rad/s]", peak, at_least=0.5 * expected))
    elif miss > 0:
        least = 0.8 * float(where.growth.max()) * speed / miss
        claims.append(Claim("peak joint speed [rad/s]", peak, at_least=least))
    else:
        claims.append(Claim("peak joint speed [rad/s]", peak, at_most=1.2 * speed))
    apart = _distance_from(where, motion.q[SAMPLES_PER_SIDE], arm)
    claims.append(Claim("distance from the singular placement (m, rad)", apart, at_most=0.21))
    return tuple(claims)


def _distance_from(where: Singularity, q: Array, arm: Robot) -> float:
    """Compute the length (m, rad) of what is asked for, from q to the singular placement."""
    kinematics = Kinematics(arm)
    kinematics.update(q)
    return float(np.linalg.norm(PoseTask().linearize(kinematics, where.placement).error))
