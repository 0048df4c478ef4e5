"""Flacco's hexagon: a position at constant speed along straight lines, beyond the joints' range."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from itertools import pairwise
from math import pi
from types import MappingProxyType
from typing import Annotated, Literal

import numpy as np
import pinocchio as pin

from dikbench.problem import Array, Drawn, Kinematics, PositionTask, Range, Robot, null_space
from dikbench.scenario import (
    Case,
    Claim,
    NamedRobotFamily,
    OracleMotion,
    Perturbation,
    Reference,
    Variation,
    measure_motion,
    placement_of,
    plane_of,
    solve_placement,
    through,
)

RADIUS_M = 0.2

SAMPLES_PER_LAP = 120
"""Samples of the motion that keeps the limits, per lap."""

PULL_PER_M = 2.0
"""Share of the way to the posture at rest by which the null space moves the joints, per metre along
the path."""


@dataclass(frozen=True)
class SetUp:
    """The start of a robot and the place of its hexagon.

    Attributes:
        start: configuration [rad].
        centre: centre of the hexagon [m].
        required: lower bound on the peak joint speed of the least-norm motion over the limits, per
            m/s along the path.
        rest: where the null space moves the joints in a motion that keeps the limits [rad]; None
            where there is no such motion.
    """

    start: tuple[float, ...]
    centre: tuple[float, float, float]
    required: float
    rest: tuple[float, ...] | None = None


SET_UPS: Mapping[str, SetUp] = MappingProxyType(
    {
        "lwr": SetUp((0.0, pi / 4, pi / 4, pi / 4, 0.0, 0.0, 0.0), (0.1, 0.35, 0.6235), 3.0),
        "planar4r": SetUp((0.0, pi / 2, -pi / 2, pi / 2), (0.7, 0.0, 0.0), 1.4, (0.0,) * 4),
        "panda": SetUp(
            (0.0, -pi / 4, 0.0, -3 * pi / 4, 0.0, pi / 2, pi / 4),
            (-0.13, -0.19, 0.74),
            0.9,
            (-0.15, 0.1, -0.8, -2.85, -0.3, 0.65, -0.45),
        ),
        "xarm7": SetUp(
            (0.0, -0.5, 0.0, 1.0, 0.0, 1.3, 0.0),
            (-0.05, -0.1, 0.58),
            0.9,
            (-0.55, -0.55, 1.15, 2.3, -0.45, 1.5, -0.55),
        ),
        "tiago": SetUp((1.4, -0.4, -1.2, 1.5, 0.0, -0.5, 0.4), (0.34, 0.28, 0.86), 0.9),
    }
)


@dataclass(frozen=True, kw_only=True)
class Hexagon(NamedRobotFamily):
    """The position follows a hexagon at constant speed; the orientation is free.

    A straight line from the start to the top of a hexagon of radius 0.2 m, then clockwise from
    corner to corner, all at the same speed: in the y-z plane about (0.1, 0.35, 0.6235) m, from
    (0, 45, 45, 45, 0, 0, 0) deg, for the LWR; in the x-y plane about (0.7, 0) m, from
    (0, 90, -90, 90) deg, for the planar arm. Panda, xArm7 and TIAGo, which are not in the original,
    have hexagons that ask for the same. The least-norm motion leaves the joints' ranges and, at
    higher speeds, exceeds their velocity limits. On the planar arm, the Panda and the xArm7 the
    null space can keep the limits: a motion that does so is the least-norm one with a pull of the
    joints towards a posture. On the TIAGo none is known, and on the LWR nothing can: a corner is
    0.30 m from the shoulder, and with the elbow at its limit of 120 deg the tool is at least 0.317
    m away. In the original each corner is the target until it is near; here the same lines are
    indexed by time, so that every formulation has the same targets. A seed moves the start by up to
    0.05 rad per joint.

    Provokes: position and velocity limits that the least-norm motion breaks

    Shows in: position_violation_max_rad, velocity_violation_max_rad_s, progress_mean

    Attributes:
        robot: one of these robots.
        speed: speed along the path.
        laps: number of laps.

    Source: Flacco, De Luca & Khatib 2012, 2015.
    """

    robot: Literal["lwr", "planar4r", "panda", "xarm7", "tiago"] = "lwr"
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
        witness = None if where.rest is None else self._kept(robot, reference, q0, where.rest)
        return Case(reference, q0, motion, claims, tracking=tracking, witness=witness)

    def _kept(
        self, robot: Robot, reference: Reference, q0: Array, rest: tuple[float, ...]
    ) -> OracleMotion:
        """Follow the path while the null space moves the joints towards a posture."""
        instants = np.linspace(0.0, reference.duration, SAMPLES_PER_LAP * (self.laps + 1) + 1)
        tracking, kinematics, motion = PositionTask(gain=self.gain), Kinematics(robot), [q0]
        rows = list(tracking.rows(robot))
        for before, tau in pairwise(instants):
            kinematics.update(motion[-1])
            Z = null_space(kinematics.jacobian(robot.frame_id)[rows], 1e-6)
            share = PULL_PER_M * self.speed * (tau - before)
            pull = share * pin.difference(robot.model, motion[-1], np.array(rest))
            seed = pin.integrate(robot.model, motion[-1], Z @ (Z.T @ pull))
            motion.append(solve_placement(robot, reference.placement(tau), seed, tracking=tracking))
        return measure_motion(robot, instants, np.array(motion), tracking)


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
