"""The obstacle of a path: its shape, and where it is so that the motion enters it."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from types import MappingProxyType
from typing import Final, Literal

import numpy as np

from dikbench.errors import DikbenchError
from dikbench.problem import Array, CollisionConstraint, Kinematics, Robot
from dikbench.scenario import BoxObstacle, CapsuleObstacle, Obstacle, SphereObstacle

Shape = Literal["sphere", "capsule", "box"]

Side = Literal["tool", "outward", "up", "down"]

SIDES: Final[tuple[Side, ...]] = ("tool", "outward", "up", "down")
"""Where an obstacle is tried: along the frame's z axis, away from the robot, above, below."""

SLOWEST_PAST_M_RAD: Final = 0.02
"""A hand that a joint moves more slowly past an obstacle does not come clear of it."""

RADIUS_M: Final = 0.05
"""Radius of the obstacle, half the edge of a box."""

CAPSULE_LENGTH_M: Final = 0.3
"""Length of the capsule's segment."""


def beside_hand(arm: Robot, q: Array, side: Side) -> tuple[Array, Array]:
    """Return the hand (3,) [m] and a direction (3,) in which an obstacle may be, at q (nq,)."""
    kinematics = Kinematics(arm)
    kinematics.update(q)
    X = kinematics.placement(arm.frame_id)
    directions = {
        "tool": X.rotation[:, 2],
        "outward": X.translation - arm.shoulder,
        "up": np.array([0.0, 0.0, 1.0]),
        "down": np.array([0.0, 0.0, -1.0]),
    }
    return X.translation.copy(), directions[side].copy()


def obstacle_at(
    arm: Robot,
    q: Array,
    joint: int,
    beside: tuple[Array, Array],
    shape: Shape,
    depth: float,
    margin: float,
) -> CollisionConstraint:
    """Place the obstacle that the motion of a joint enters at q by `depth`, and constrain it.

    Args:
        arm: the robot.
        q: configuration half way, (nq,).
        joint: the joint that moves past it (index into v).
        beside: the point (3,) [m] of the robot beside which it is, and the direction (3,) to it.
        shape: of the obstacle.
        depth: [m].
        margin: distance to keep [m].

    Raises:
        DikbenchError: if the joint moves that part towards the obstacle, not past it.
    """
    kinematics = Kinematics(arm)
    kinematics.update(q)
    point, away = beside
    along = point_velocity(kinematics.spatial_jacobian[:, joint], point)
    away = away / np.linalg.norm(away)
    along = along - along @ away * away
    if np.linalg.norm(along) < SLOWEST_PAST_M_RAD:
        raise DikbenchError(f"joint {joint + 1} does not move past an obstacle there")
    along /= np.linalg.norm(along)
    make = _SHAPES[shape]

    def constraint(offset: float) -> CollisionConstraint:
        solid = make(point + offset * away, np.column_stack([along, np.cross(away, along), away]))
        return CollisionConstraint((solid,), self_collision=False, margin=margin)

    near, far = 0.0, 0.6
    while far - near > 1e-9:
        half = (near + far) / 2
        inside = constraint(half).distances(arm, q[None])[0] < -depth
        near, far = (half, far) if inside else (near, half)
    return constraint(far)


def point_velocity(twist: Array, point: Array) -> Array:
    """Compute the velocity (3,) of a point under a twist given at the world's origin."""
    velocity: Array = twist[:3] + np.cross(twist[3:], point)
    return velocity


def _sphere(centre: Array, axes: Array) -> Obstacle:
    del axes
    return SphereObstacle(tuple(centre), RADIUS_M)


def _capsule(centre: Array, axes: Array) -> Obstacle:
    return CapsuleObstacle(tuple(centre), tuple(centre + CAPSULE_LENGTH_M * axes[:, 2]), RADIUS_M)


def _box(centre: Array, axes: Array) -> Obstacle:
    return BoxObstacle(tuple(centre), (2 * RADIUS_M,) * 3, tuple(map(tuple, axes)))


_SHAPES: Mapping[Shape, Callable[[Array, Array], Obstacle]] = MappingProxyType(
    {"sphere": _sphere, "capsule": _capsule, "box": _box}
)
