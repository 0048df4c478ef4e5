"""An obstacle that the exact joint motion of a path hits with its hand or elbow."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from types import MappingProxyType
from typing import Annotated, Literal

import numpy as np
import pinocchio as pin

from dikbench.errors import DikbenchError
from dikbench.problem import Array, CollisionConstraint, Drawn, Kinematics, Range, Robot, null_space
from dikbench.scenario import (
    Case,
    Certificate,
    Claim,
    Family,
    OracleMotion,
    Perturbation,
    Reference,
    SphereObstacle,
    Variation,
    collision_claims,
    duration_at,
    influence_distance,
    joint_path,
    measure_motion,
    solve_placement,
    usual_claims,
)
from scenarios.obstacle_placing import (
    RADIUS_M,
    SIDES,
    Shape,
    Side,
    beside_hand,
    obstacle_at,
    point_velocity,
)

Where = Literal["hand", "elbow"]


@dataclass(frozen=True)
class Swing:
    """The swing of a robot past an obstacle.

    Attributes:
        joint: the joint that swings (index into v).
        amplitude: its offset to either side of the middle [rad].
        middle: posture half way [rad]; None: the robot's start.
    """

    joint: int
    amplitude: float
    middle: tuple[float, ...] | None = None


SWINGS: Mapping[Where, Mapping[str, Swing]] = MappingProxyType(
    {
        "hand": {robot: Swing(0, 0.6) for robot in ("panda", "ur3", "ur5", "ur10", "xarm7")},
        # The shoulder swings in the plane of the arm; the null space turns the elbow out of it.
        "elbow": {
            "panda": Swing(1, 0.8),
            "xarm7": Swing(1, 0.75),
            "lwr": Swing(1, 0.6, (0.0, 0.95, 0.0, 1.2, 0.0, 0.9, 0.0)),
        },
    }
)

ELBOW_JOINT = 4
"""Pinocchio's index of the elbow joint of the three arms with seven joints."""

AMPLITUDE_RAD = 0.6
"""Amplitude of a swing that is not chosen by hand, or less where a joint's range is short."""

ROOM_RAD = 0.2
"""Distance from a position limit at which such a swing turns back."""

SHORTEST_SWING_M = 0.1
"""Least amplitude of the hand in such a swing."""

MARGIN_M = 0.01
"""Distance to keep."""


@dataclass(frozen=True, kw_only=True)
class ObstacleInTheWay(Family):
    """A path whose exact joint motion hits an obstacle with the hand or the elbow.

    One joint swings past the middle posture and the task frame follows,

        q(t) = q_m + (2 s - 1) a e_j,   s = u^3 (10 - 15 u + 6 u^2),   u = t/T.

    With `hand` the base swings, and half way the hand is `depth` inside an obstacle in front of it:
    a motion that keeps clear leaves the path and returns. With `elbow` (panda, xarm7, lwr) the
    shoulder swings in the plane of the arm and the obstacle is next to the elbow, in the direction
    in which the null space moves it; a motion that does the whole task and keeps clear exists, and
    is certified. The swings of five arms were chosen by hand; for any other the joint with the
    longest lever is taken, and the direction from the hand to the obstacle, with which the
    certificate holds. A sphere or capsule has the radius
    0.05 m, a cube edges of 0.1 m; a capsule points at the robot. The margin is 0.01 m, from
    capsules around the links (see `dikbench.robots.collision.bodies`). A seed moves the middle
    posture by up to 0.03 rad per joint and changes the duration by up to 10 %.

    Provokes: collisions of links with an obstacle

    Shows in: distance_min_m, distance_violation_max_m, position_error_max_m

    Attributes:
        robot: a robot's name, or the path of a URDF; with elbow panda, xarm7 or lwr.
        where: the part that hits the obstacle.
        shape: shape of the obstacle.
        depth: largest depth of the exact motion inside the obstacle.
        speed: peak joint speed of the exact motion over its limit.

    Source: Faverjon & Tournassoud 1987 (obstacles near a manipulator); Maciejewski & Klein 1985
    (the null space of a redundant arm keeps it clear).
    """

    where: Annotated[Where, Drawn()] = "hand"
    shape: Annotated[Shape, Drawn()] = "sphere"
    depth: Annotated[float, Range(0.01, 0.05, "m"), Drawn(0.015, 0.04)] = 0.03
    speed: Annotated[float, Range(0.05, 0.9), Drawn(0.1, 0.6)] = 0.3

    robots = ("panda", "ur3", "ur5", "ur10", "xarm7", "kinova", "tiago", "lwr")
    variation = Variation(start=0.03, timing=0.1)

    def check(self) -> None:
        """Check that the robot's elbow is known."""
        if self.where == "elbow" and self.robot not in SWINGS[self.where]:
            valid = ", ".join(SWINGS[self.where])
            raise DikbenchError(f"robot={self.robot} with where={self.where}; valid: {valid}")

    def case(self, robot: Robot, change: Perturbation) -> Case:
        """See `Family`."""
        known = SWINGS[self.where].get(self.robot)
        if known is not None:
            return self._past(robot, known, "tool", *self._swung(robot, change, known))
        _check_hand(robot)
        refused = ""
        for swing in _swings(robot):
            try:
                swung = self._swung(robot, change, swing)
                motion = swung[2]
                easy = usual_claims(motion, speed=(0.0, 1.0), sigma_min=0.04, margin=0.1)
                Certificate(easy).check(f"joint {swing.joint + 1}")
            except DikbenchError as error:
                refused = refused or str(error)
                continue
            for side in SIDES:
                try:
                    found = self._past(robot, swing, side, *swung)
                    Certificate(found.claims).check(f"joint {swing.joint + 1}")
                except DikbenchError as error:
                    refused = refused or str(error)
                else:
                    return found
        raise DikbenchError(
            f"robot {robot.name}: no joint swings the frame {robot.frame} past an obstacle from "
            f"its start{f'; first tried: {refused}' if refused else ''}"
        )

    def _swung(
        self, robot: Robot, change: Perturbation, swing: Swing
    ) -> tuple[Array, Reference, OracleMotion]:
        """Compute the start (nq,), the path and the exact motion of a swing."""
        middle = robot.q0 if swing.middle is None else np.array(swing.middle)
        middle = change.posture(robot, middle)
        q0, at_one_second = _swing(robot, middle, swing, 1.0)
        duration = duration_at(robot, at_one_second, q0, self.speed, self.dt) * change.pace
        _, reference = _swing(robot, middle, swing, duration)
        return q0, reference, self.exact_motion(robot, reference, q0, most=100)

    def _past(
        self,
        robot: Robot,
        swing: Swing,
        side: Side,
        q0: Array,
        reference: Reference,
        motion: OracleMotion,
    ) -> Case:
        """Make the case of a swing, the obstacle on a side of the hand."""
        half_way = motion.q[len(motion.q) // 2]
        in_the_way = (
            _beside_elbow(robot, half_way)
            if self.where == "elbow"
            else beside_hand(robot, half_way, side)
        )
        constraint = replace(
            obstacle_at(robot, half_way, swing.joint, in_the_way, self.shape, self.depth, MARGIN_M),
            influence=influence_distance(robot),
        )
        distance, depth = constraint.distances(robot, motion.q), 0.8 * self.depth
        claims = collision_claims(motion, distance, MARGIN_M, depth=depth, speed=self.speed)
        other = None
        if self.where == "hand":
            carried = _distance_of_hand(robot, half_way, constraint)
            claims += (Claim("distance of the hand on its path [m]", carried, -0.1, -depth),)
        else:
            q = _clear_motion(robot, reference, motion.instants, q0, constraint)
            clear = constraint.distances(robot, q).min()
            other = measure_motion(robot, motion.instants, q)
            margin, fastest = other.margin.min(), other.peak_speed_ratio
            claims += (
                Claim("least distance of another motion that does it [m]", clear, MARGIN_M),
                Claim("position margin of that motion [rad]", margin, at_least=0.05),
                Claim("required speed of that motion over limit", fastest, at_most=1.0),
            )
        return Case(reference, q0, motion, claims, constraints=(constraint,), witness=other)


def _check_hand(arm: Robot) -> None:
    """Check that the robot has collision geometry that moves with the task frame.

    Raises:
        DikbenchError: if it has not.
    """
    far = SphereObstacle((0.0, 0.0, 0.0), RADIUS_M)
    pairs = CollisionConstraint((far,), self_collision=False).pairs(arm)
    if not any(_hand(arm) & {*joints} for joints in pairs.joints):
        raise DikbenchError(
            f"robot {arm.name}: no collision geometry moves with the frame {arm.frame}"
        )


def _hand(arm: Robot) -> set[int]:
    """Return Pinocchio's indices of the task frame's joint and of those that it carries."""
    return set(arm.model.subtrees[arm.model.frames[arm.frame_id].parentJoint])


def _swings(arm: Robot) -> Iterator[Swing]:
    """Yield swings of the joints that turn, those with the longest levers at the start first."""
    kinematics, limits = Kinematics(arm), arm.limits.at(arm.q0)
    kinematics.update(arm.q0)
    J = kinematics.spatial_jacobian
    hand = kinematics.placement(arm.frame_id).translation
    room = np.full(arm.nv, np.inf)
    if limits.to_lower is not None and limits.to_upper is not None:
        room = np.minimum(limits.to_lower, limits.to_upper) - ROOM_RAD
    levers = {int(j): float(np.linalg.norm(point_velocity(J[:, j], hand))) for j in arm.chain}
    for j in sorted(levers, key=lambda j: -levers[j]):
        amplitude = min(AMPLITUDE_RAD, float(room[j]))
        if np.linalg.norm(J[3:, j]) > 0 and amplitude * levers[j] >= SHORTEST_SWING_M:
            yield Swing(j, amplitude)


def _swing(arm: Robot, middle: Array, swing: Swing, duration: float) -> tuple[Array, Reference]:
    """Compute the start (nq,) and the path of the task frame of a swing past the middle."""
    offset = np.zeros(arm.nv)
    offset[swing.joint] = swing.amplitude

    def q_r(tau: float) -> Array:
        u = tau / duration
        s = u**3 * (10 - 15 * u + 6 * u**2)
        q: Array = pin.integrate(arm.model, middle, (2 * s - 1) * offset)
        return q

    def v_r(tau: float) -> Array:
        u = tau / duration
        v: Array = 60 * u**2 * (1 - u) ** 2 / duration * offset
        return v

    return q_r(0.0), joint_path(arm, q_r, v_r, duration)


def _beside_elbow(arm: Robot, q: Array) -> tuple[Array, Array]:
    """Return the elbow (3,) [m] and the direction (3,) in which the null space moves it."""
    _, elbow, velocity = _elbow_turn(arm, q)
    return elbow, velocity


def _elbow_turn(arm: Robot, q: Array) -> tuple[Array, Array, Array]:
    """Compute the null-space direction (nv,) of the elbow to the right, elbow, velocity.

    Elbow (3,) [m] and its velocity (3,) are in the world, whose x axis points forward.
    """
    kinematics = Kinematics(arm)
    kinematics.update(q)
    pin.forwardKinematics(arm.model, arm.scratch, q)
    elbow = arm.scratch.oMi[ELBOW_JOINT].translation.copy()
    z = null_space(kinematics.jacobian(arm.frame_id), 1e-6)[:, 0]
    before = slice(0, ELBOW_JOINT - 1)  # the joints that move the elbow
    velocity = point_velocity(kinematics.spatial_jacobian[:, before] @ z[before], elbow)
    sign = -np.sign(velocity[1])
    return sign * z, elbow, sign * velocity


def _distance_of_hand(arm: Robot, q: Array, constraint: CollisionConstraint) -> float:
    """Compute the least distance [m] of what the task frame's joint carries, fingers too."""
    kinematics, pairs = Kinematics(arm), constraint.pairs(arm)
    kinematics.update(q)
    hand = _hand(arm)
    carried = np.array([bool(hand & {*joints}) for joints in pairs.joints])
    return float(pairs.distances(kinematics)[carried].min())


def _clear_motion(
    arm: Robot, reference: Reference, instants: Array, q0: Array, constraint: CollisionConstraint
) -> Array:
    """Find configurations (k + 1, nq) that follow the reference and keep clear.

    The elbow turns away by as little as needed, in steps of 0.1, and returns: the offset in
    the null space is proportional to sin^2(pi t/T). The last motion is returned if none is clear.
    """
    for turn in 0.1 * np.arange(1, 13):
        q = _turned(arm, reference, instants, q0, turn)
        if constraint.distances(arm, q).min() >= constraint.margin:
            break
    return q


def _turned(arm: Robot, reference: Reference, instants: Array, q0: Array, turn: float) -> Array:
    motion = [q0]
    turned = turn * np.sin(np.pi * instants / instants[-1]) ** 2
    for tau, step in zip(instants[1:], np.diff(turned), strict=True):
        z, _, _ = _elbow_turn(arm, motion[-1])
        q = pin.integrate(arm.model, motion[-1], -step * z)
        motion.append(solve_placement(arm, reference.placement(tau), q))
    return np.array(motion)
