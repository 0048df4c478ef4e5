"""Flacco's hexagon: a position at constant speed along straight lines, beyond the joints' range."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from math import pi
from types import MappingProxyType
from typing import Annotated, Literal

import numpy as np
import pinocchio as pin

from dikbench.problem import Array, Drawn, PositionTask, Range, Robot
from dikbench.scenario import (
    Case,
    Claim,
    Family,
    Perturbation,
    Reference,
    Variation,
    placement_of,
    plane_of,
    through,
)

RADIUS_M = 0.2


@dataclass(frozen=True)
class SetUp:
    """The start of a robot and the place of its hexagon.

    Attributes:
        start: configuration [rad].
        centre: centre of the hexagon [m].
        required: lower bound on the peak joint speed of the least-norm motion over the limits, per
            m/s along the path.
    """

    start: tuple[float, ...]
    centre: tuple[float, float, float]
    required: float


SET_UPS: Mapping[str, SetUp] = MappingProxyType(
    {
        "lwr": SetUp((0.0, pi / 4, pi / 4, pi / 4, 0.0, 0.0, 0.0), (0.1, 0.35, 0.6235), 3.0),
        "planar4r": SetUp((0.0, pi / 2, -pi / 2, pi / 2), (0.7, 0.0, 0.0), 1.4),
    }
)


@dataclass(frozen=True, kw_only=True)
class Hexagon(Family):
    """The position follows a hexagon at constant speed; the orientation is free.

    A straight line from the start to the top of a hexagon of radius 0.2 m, then clockwise from
    corner to corner, all at the same speed: in the y-z plane about (0.1, 0.35, 0.6235) m, from
    (0, 45, 45, 45, 0, 0, 0) deg, for the LWR; in the x-y plane about (0.7, 0) m, from
    (0, 90, -90, 90) deg, for the planar arm. The least-norm motion leaves the joints' ranges and,
    at higher speeds, exceeds their velocity limits: only the null space can keep the limits. In the
    original each corner is the target until it is near; here the same lines are indexed by time, so
    that every formulation has the same targets. A seed moves the start by up to 0.05 rad per joint.

    Provokes: position and velocity limits that only the null space can keep

    Shows in: position_violation_max_rad, velocity_violation_max_rad_s, progress_mean

    Attributes:
        robot: one of these robots.
        speed: speed along the path.
        laps: number of laps.

    Source: Flacco, De Luca & Khatib 2012, 2015.
    """

    robot: Literal["lwr", "planar4r"] = "lwr"
    frame: None = None
    dt: float = 0.001
    speed: Annotated[float, Range(0.05, 2.0, "m/s"), Drawn(0.2, 1.2)] = 0.5
    laps: Annotated[int, Range(1, 5)] = 2

    variation = Variation(start=0.05)
    about_position_limits = True

    def case(self, robot: Robot, change: Perturbation) -> Case:
        """See `Family`."""
        where, tracking = SET_UPS[self.robot], PositionTask(gain=self.gain)
        q0 = change.posture(robot, np.array(where.start))
        reference = _path(robot, q0, np.array(where.centre), self.speed, self.laps)
        # Many samples: the least-norm motion of the LWR passes a singularity of its position.
        motion = self.exact_motion(robot, reference, q0, tracking, most=800)
        fastest, required = motion.peak_speed_ratio, where.required * self.speed
        claims = (
            Claim("position margin at the start [rad]", motion.margin[0], at_least=0.5),
            Claim("margin of the least-norm motion [rad]", motion.margin.min(), at_most=-0.05),
            Claim("required speed over limit", fastest, at_least=required),
        )
        return Case(reference, q0, motion, claims, tracking=tracking)


def _path(arm: Robot, q0: Array, centre: Array, speed: float, laps: int) -> Reference:
    start = placement_of(arm, q0)
    angles = pi / 2 - pi / 3 * np.arange(6 * laps + 1)
    circle = RADIUS_M * np.stack([np.cos(angles), np.sin(angles)], axis=1)
    corners = centre + circle @ plane_of(arm).T
    points = np.vstack([start.translation, corners])
    lengths = np.linalg.norm(np.diff(points, axis=0), axis=1)
    times = np.concatenate([[0.0], np.cumsum(lengths) / speed])
    path = through(
        times.tolist(), [pin.SE3(start.rotation, point) for point in points], smooth=False
    )
    return replace(path, period=6 * RADIUS_M / speed, first_lap=float(times[1]))
