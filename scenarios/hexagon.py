"""Flacco's hexagon: a position at constant speed along straight lines, beyond the joints' range."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from math import pi
from types import MappingProxyType
from typing import Literal

import numpy as np
import pinocchio as pin

from dikbench.scenario import (
    Array,
    Certificate,
    Claim,
    PositionTask,
    Reference,
    Robot,
    Scenario,
    Variation,
    between,
    limits_in_force,
    load_robot,
    oracle_motion,
    placement_of,
    plane_of,
    positive,
    samples,
    secondary_tasks,
    start_velocity,
    through,
)

VARIATION = Variation(start=0.05)

RADIUS = 0.2


@dataclass(frozen=True)
class SetUp:
    """Where a robot starts and where its hexagon lies.

    Attributes:
        start: configuration [rad].
        centre: of the hexagon [m].
        required: peak joint speed of the least-norm motion over the limits, per m/s along the path,
            at least.
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


def hexagon(
    robot: Literal["lwr", "planar4r"] = "lwr",
    *,
    speed: float = 0.5,
    laps: int = 2,
    gain: float = 5.0,
    dt: float = 0.001,
    acceleration: bool = False,
    seed: int = 0,
) -> Scenario:
    """The position follows a hexagon at constant speed, orientation free: a redundant arm's test.

    A straight line from the start to the top of a hexagon of radius 0.2 m, then round it clockwise
    from corner to corner, all at the same speed: in the y-z plane about (0.1, 0.35, 0.6235) m, from
    (0, 45, 45, 45, 0, 0, 0) deg, for the LWR; in the x-y plane about (0.7, 0) m, from
    (0, 90, -90, 90) deg, for the planar arm. The least-norm motion leaves the joints' range and, as
    the speed grows, their speeds: only the null space can help. The original steers for a corner
    until it is near, with the speed along the line as its parameter; here the same lines are
    indexed by time, so that every law is asked for the same. A seed moves the start by up to
    0.05 rad per joint.

    Provokes: position and velocity limits that only the null space can keep

    Shows in: position_violation_max_rad, velocity_violation_max_rad_s, progress_mean

    Args:
        robot: lwr or planar4r.
        speed: along the path [m/s], 0.05 to 2.
        laps: number of laps, 1 to 5.
        gain: of the tracking task, 1/s.
        dt: control period [s].
        acceleration: whether acceleration limits are in force.
        seed: 0 perturbs nothing.

    Source: Flacco, De Luca & Khatib 2012, 2015.
    """
    positive("hexagon", gain=gain, dt=dt)
    between("hexagon", "speed", speed, 0.05, 2.0)
    between("hexagon", "laps", laps, 1, 5)
    arm = limits_in_force(load_robot(robot), acceleration=acceleration)
    where, tracking = SET_UPS[robot], PositionTask(gain=gain)
    q0 = VARIATION.drawn(seed).posture(arm, np.array(where.start))
    reference = _path(arm, q0, np.array(where.centre), speed, laps)
    # Close together: the least-norm motion of the LWR passes a singularity of its position.
    instants = samples(reference.duration, dt, most=800)
    motion = oracle_motion(arm, reference, q0, instants, tracking)
    certificate = Certificate(
        (
            Claim("position margin at the start [rad]", motion.margin[0], at_least=0.5),
            Claim("margin of the least-norm motion [rad]", motion.margin.min(), at_most=-0.05),
            Claim(
                "required speed over limit",
                motion.speed_ratio.max(),
                at_least=where.required * speed,
            ),
        )
    )
    return Scenario(
        robot=arm,
        q0=q0,
        v0=start_velocity(arm, reference, q0, tracking),
        reference=reference,
        tracking=tracking,
        dt=dt,
        duration=reference.duration,
        certificate=certificate,
        tasks=secondary_tasks(arm, q0, tracking),
        motion=motion,
        variation=VARIATION,
    )


def _path(arm: Robot, q0: Array, centre: Array, speed: float, laps: int) -> Reference:
    start = placement_of(arm, q0)
    angles = pi / 2 - pi / 3 * np.arange(6 * laps + 1)
    corners = centre + RADIUS * np.stack([np.cos(angles), np.sin(angles)], axis=1) @ plane_of(arm).T
    points = np.vstack([start.translation, corners])
    lengths = np.linalg.norm(np.diff(points, axis=0), axis=1)
    times = np.concatenate([[0.0], np.cumsum(lengths) / speed])
    path = through(
        times.tolist(), [pin.SE3(start.rotation, point) for point in points], smooth=False
    )
    return replace(path, period=6 * RADIUS / speed, first_lap=float(times[1]))
