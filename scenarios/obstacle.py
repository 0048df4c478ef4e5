"""An obstacle that the exact joint motion of a path hits with its hand or elbow."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from types import MappingProxyType
from typing import Annotated, Literal

import numpy as np
import pinocchio as pin

from dikbench.errors import DikbenchError
from dikbench.problem import Array, CollisionConstraint, Drawn, Kinematics, Range, Robot, null_space
from dikbench.scenario import (
    BoxObstacle,
    CapsuleObstacle,
    Case,
    Claim,
    Family,
    Obstacle,
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
)

Where = Literal["hand", "elbow"]
Shape = Literal["sphere", "capsule", "box"]


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

OBSTACLE_RADIUS_M = 0.05
"""Radius of the obstacle, half the edge of a box."""

CAPSULE_LENGTH_M = 0.3
"""Length of the capsule's segment."""

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
    is certified. A sphere or capsule has the radius
    0.05 m, a cube edges of 0.1 m; a capsule points at the robot. The margin is 0.01 m, from
    capsules around the links (see `dikbench.robots.collision.bodies`). A seed moves the middle
    posture by up to 0.03 rad per joint and changes the duration by up to 10 %.

    Provokes: collisions of links with an obstacle

    Shows in: distance_min_m, distance_violation_max_m, position_error_max_m

    Attributes:
        robot: one of these robots; lwr with elbow only, ur3, ur5 and ur10 with hand only.
        where: the part that hits the obstacle.
        shape: shape of the obstacle.
        depth: largest depth of the exact motion inside the obstacle.
        speed: peak joint speed of the exact motion over its limit.

    Source: Faverjon & Tournassoud 1987 (obstacles near a manipulator); Maciejewski & Klein 1985
    (the null space of a redundant arm keeps it clear).
    """

    robot: Literal["panda", "ur3", "ur5", "ur10", "xarm7", "lwr"] = "panda"
    frame: None = None
    where: Annotated[Where, Drawn()] = "hand"
    shape: Annotated[Shape, Drawn()] = "sphere"
    depth: Annotated[float, Range(0.01, 0.05, "m"), Drawn(0.015, 0.04)] = 0.03
    speed: Annotated[float, Range(0.05, 0.9), Drawn(0.1, 0.6)] = 0.3

    variation = Variation(start=0.03, timing=0.1)

    def check(self) -> None:
        """Check that the robot swings past an obstacle there."""
        if self.robot not in SWINGS[self.where]:
            valid = ", ".join(SWINGS[self.where])
            raise DikbenchError(f"robot={self.robot} with where={self.where}; valid: {valid}")

    def case(self, robot: Robot, change: Perturbation) -> Case:
        """See `Family`."""
        swing = SWINGS[self.where][self.robot]
        middle = robot.q0 if swing.middle is None else np.array(swing.middle)
        middle = change.posture(robot, middle)
        q0, at_one_second = _swing(robot, middle, swing, 1.0)
        duration = duration_at(robot, at_one_second, q0, self.speed, self.dt) * change.pace
        _, reference = _swing(robot, middle, swing, duration)
        motion = self.exact_motion(robot, reference, q0, most=100)
        half_way = motion.q[len(motion.q) // 2]
        constraint = replace(
            _in_the_way(robot, half_way, swing.joint, self.where, self.shape, self.depth),
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


def _in_the_way(
    arm: Robot, q: Array, joint: int, where: Where, shape: Shape, depth: float
) -> CollisionConstraint:
    """Place the obstacle that the motion enters at q by `depth`, and constrain it."""
    kinematics = Kinematics(arm)
    kinematics.update(q)
    J = kinematics.spatial_jacobian
    if where == "hand":
        X = kinematics.placement(arm.frame_id)
        point, away = X.translation.copy(), X.rotation[:, 2].copy()
    else:
        _, point, away = _elbow_turn(arm, q)
    along = _velocity(J[:, joint], point)
    away /= np.linalg.norm(away)
    along -= along @ away * away
    along /= np.linalg.norm(along)
    make = _SHAPES[shape]

    def constraint(offset: float) -> CollisionConstraint:
        solid = make(point + offset * away, np.column_stack([along, np.cross(away, along), away]))
        return CollisionConstraint((solid,), self_collision=False, margin=MARGIN_M)

    near, far = 0.0, 0.6
    while far - near > 1e-9:
        half = (near + far) / 2
        inside = constraint(half).distances(arm, q[None])[0] < -depth
        near, far = (half, far) if inside else (near, half)
    return constraint(far)


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
    velocity = _velocity(kinematics.spatial_jacobian[:, before] @ z[before], elbow)
    sign = -np.sign(velocity[1])
    return sign * z, elbow, sign * velocity


def _velocity(twist: Array, point: Array) -> Array:
    """Compute the velocity (3,) of a point under a twist given at the world's origin."""
    velocity: Array = twist[:3] + np.cross(twist[3:], point)
    return velocity


def _distance_of_hand(arm: Robot, q: Array, constraint: CollisionConstraint) -> float:
    """Compute the least distance [m] of what the task frame's joint carries."""
    kinematics, pairs = Kinematics(arm), constraint.pairs(arm)
    kinematics.update(q)
    joint = arm.model.frames[arm.frame_id].parentJoint
    carried = np.array([joint in joints for joints in pairs.joints])
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


def _sphere(centre: Array, axes: Array) -> Obstacle:
    del axes
    return SphereObstacle(tuple(centre), OBSTACLE_RADIUS_M)


def _capsule(centre: Array, axes: Array) -> Obstacle:
    return CapsuleObstacle(
        tuple(centre), tuple(centre + CAPSULE_LENGTH_M * axes[:, 2]), OBSTACLE_RADIUS_M
    )


def _box(centre: Array, axes: Array) -> Obstacle:
    return BoxObstacle(tuple(centre), (2 * OBSTACLE_RADIUS_M,) * 3, tuple(map(tuple, axes)))


_SHAPES: Mapping[Shape, Callable[[Array, Array], Obstacle]] = MappingProxyType(
    {"sphere": _sphere, "capsule": _capsule, "box": _box}
)
