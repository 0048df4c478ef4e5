"""Closed curves in a plane at a constant rate: circle and lemniscate."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, Final

import numpy as np
import pinocchio as pin

from dikbench.arrays import Array
from dikbench.robots.robot import Robot
from dikbench.scenario.reference.reference import Placed, Placement, Reference
from dikbench.scenario.reference.screws import exp3

WORLD_YZ_PLANE: Final = np.array([[0.0, 0.0], [1.0, 0.0], [0.0, 1.0]])
"""The world's y-z plane: its two axes as columns, (3, 2)."""

WORLD_XY_PLANE: Final = np.array([[1.0, 0.0], [0.0, 1.0], [0.0, 0.0]])
"""The world's x-y plane, in which planar arms move, (3, 2)."""


def plane_of(robot: Robot) -> Array:
    """Return the plane in which a robot's curves lie, its two axes as columns (3, 2)."""
    return WORLD_YZ_PLANE if 2 in robot.movable_rows else WORLD_XY_PLANE


def circle(
    start: Any,
    radius: float,
    period: float,
    laps: float,
    *,
    plane: Array = WORLD_YZ_PLANE,
    turn: float = 0.0,
) -> Reference:
    """Build a circle through `start`, its point with the smallest second coordinate.

        p = p_0 + P radius (sin w tau, 1 - cos w tau),   w = 2 pi / period

    Args:
        start: placement at tau = 0.
        radius: [m].
        period: nominal time of a lap [s].
        laps: number of laps.
        plane: P, the axes of its plane as columns, (3, 2).
        turn: the frame turns about the normal of the plane by turn sin w tau [rad].
    """
    return _curve(
        (start, period, laps, plane, turn),
        lambda angle: radius * np.array([np.sin(angle), 1 - np.cos(angle)]),
        lambda angle: radius * np.array([np.cos(angle), np.sin(angle)]),
    )


def lemniscate(
    start: Any,
    size: float,
    period: float,
    laps: float,
    *,
    plane: Array = WORLD_YZ_PLANE,
    turn: float = 0.0,
) -> Reference:
    """Build a figure of eight that crosses itself in `start`.

        p = p_0 + P size (sin w tau, sin(2 w tau) / 2),   w = 2 pi / period

    Args:
        start: placement at tau = 0.
        size: half its width, twice its height [m].
        period: nominal time of a lap [s].
        laps: number of laps.
        plane: P, the axes of its plane as columns, (3, 2).
        turn: the frame turns about the normal of the plane by turn sin w tau [rad].
    """
    return _curve(
        (start, period, laps, plane, turn),
        lambda angle: size * np.array([np.sin(angle), np.sin(2 * angle) / 2]),
        lambda angle: size * np.array([np.cos(angle), np.cos(2 * angle)]),
    )


def _curve(
    given: tuple[Any, float, float, Array, float],
    offset: Callable[[Any], Array],
    tangent: Callable[[float], Array],
) -> Reference:
    """Build a curve from its offset from `start`, (2,) [m], and its derivative, at an angle.

    The offset is also that at each of several angles (n,), (2, n).
    """
    start, period, laps, plane, turn = given
    first: Array = start.rotation.copy()
    origin = start.translation.copy()
    normal = np.cross(plane[:, 0], plane[:, 1])
    rate = 2 * np.pi / period

    def rotation(angle: float) -> Array:
        if turn == 0:
            return first  # without rounding
        turned: Array = pin.exp3(turn * np.sin(angle) * normal) @ first
        return turned

    def placement(tau: float) -> Any:
        angle = rate * tau
        return pin.SE3(rotation(angle), origin + plane @ offset(angle))

    def many(times: Array) -> Placed:
        angles = rate * times
        turned = exp3(turn * np.sin(angles)[:, None] * normal) @ first
        return turned, origin + offset(angles).T @ plane.T

    def velocity(tau: float) -> Array:
        angle = rate * tau
        world = np.array([plane @ tangent(angle), turn * np.cos(angle) * normal])
        twist: Array = rate * (world @ rotation(angle)).ravel()
        return twist

    return Reference(laps * period, Placement(placement, many), velocity, period=period)
