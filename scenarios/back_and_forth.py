"""The trajectory of pink_bench: a wide sweep of position and orientation, back and forth."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from math import inf, pi
from types import MappingProxyType
from typing import Annotated, Any

import numpy as np
import pinocchio as pin

from dikbench.errors import DikbenchError
from dikbench.problem import Array, Drawn, Range, Robot
from dikbench.scenario import (
    Case,
    Certificate,
    Claim,
    Family,
    OracleMotion,
    Perturbation,
    Reference,
    Variation,
    placement_of,
    solve_placement,
    usual_claims,
)

START_M = np.array([0.4, 0.8, 0.4])
STOP_M = np.array([-0.4, 0.6, 0.6])
DURATION_S = 10.0

SHARES = tuple(0.8**k for k in range(14))
"""Shares of the reach, and of the rotation of pi/4, that are tried where no path is known."""

SLOW_MIDDLE = 0.7
"""Least joint speed per length of a short middle of a path, over that of the whole: the joints need
not hurry most there."""

SMALLEST_SCALE = 0.05
"""Of a path that is a sweep."""


@dataclass(frozen=True)
class SetUp:
    """The path and certificate of a robot.

    Attributes:
        frame: its task frame.
        scale: scale of the path.
        roll: roll of the target orientation about x [rad].
        near: a configuration near the start of the path [rad].
        speed: bounds on the peak joint speed over the limits.
        sigma_min: smallest singular value on the path (m, rad).
    """

    frame: str
    scale: float
    roll: float
    near: tuple[float, ...]
    speed: tuple[float, float]
    sigma_min: float


SET_UPS: Mapping[str, SetUp] = MappingProxyType(
    {
        "ur3": SetUp("ee_link", 0.5, 0, (0.87, -0.52, 1.37, 2.3, -1.65, 0), (0.5, 0.66), 0.1),
        "ur5": SetUp("ee_link", 0.9, 0, (0.99, -0.66, 0.88, 2.93, -1.78, 0), (0.33, 0.44), 0.13),
        "ur10": SetUp("ee_link", 1.0, 0, (0.94, -0.98, 1.65, 2.48, -1.72, 0), (0.48, 0.63), 0.3),
        "panda": SetUp(
            "panda_hand",
            0.7,
            pi / 2,
            (1.28, 0.69, 0.03, -1.58, -1.23, 1.17, 1.56),
            (0.38, 0.52),
            0.14,
        ),
    }
)


@dataclass(frozen=True, kw_only=True)
class BackAndForth(Family):
    """A wide sweep of position and orientation, back and forth for 10 s: pink_bench's trajectory.

        p = scale (start + (stop - start) s),
        R = Rz(pi/4 (1 + s)) Rx(pi/4 s) R_t,   s = (1 - size)/2 + size sin^2 t

    with start (0.4, 0.8, 0.4) m, stop (-0.4, 0.6, 0.6) m. UR3, UR5 and UR10 have the frame
    `ee_link`, R_t = I and scale 0.5, 0.9, 1.0; the Panda `panda_hand`, Rx(pi/2) and 0.7. In the
    original the arms first move to the path; here they start on it. For any other robot the middle
    of the sweep is the placement of its start, turned about the vertical to lie across the arm, and
    the size of the sweep and its rotation is the largest that certifies, from the robot's distance
    from its first joint (and pi/4) down; a planar arm sweeps in its plane. A smaller `size` is the
    middle of the same path in the same time. A seed turns the whole path about the vertical by up
    to 0.2 rad and changes its pace by up to 10 %.

    Provokes: a wide and steady sweep, inside all limits

    Shows in: position_error_rms_m, orientation_error_rms_rad

    Attributes:
        size: share of the path that is swept.

    Source: pink_bench (Caron), back-and-forth trajectory.
    """

    robot: str = "ur5"
    dt: float = 0.005
    size: Annotated[float, Range(0.2, 1.0), Drawn(0.4, 1.0)] = 1.0

    robots = (*SET_UPS, "xarm7", "kinova", "tiago", "talos", "lwr")
    variation = Variation(direction=0.2, timing=0.1)

    def case(self, robot: Robot, change: Perturbation) -> Case:
        """See `Family`."""
        if self.robot not in SET_UPS or not self.as_catalogued:
            return self._largest(robot, change)
        where = SET_UPS[self.robot]
        arm = replace(robot, frame=where.frame)
        # A rotation of the path about another axis would leave the reach.
        yaw = float(pin.log3(change.rotation(arm))[2])
        target = pin.utils.rotate("x", where.roll)
        turned = pin.utils.rotate("z", yaw)
        first, offset = (turned @ (where.scale * x) for x in (START_M, STOP_M - START_M))
        reference = _path(first, offset, yaw, target, change.pace, self.size)
        q0 = solve_placement(arm, reference.placement(0.0), np.array(where.near))
        motion = self.exact_motion(arm, reference, q0)
        least, largest = (self.size * speed for speed in where.speed)
        least *= SLOW_MIDDLE + (1 - SLOW_MIDDLE) * self.size
        claims = (
            Claim(
                "sweep from end to end [m]",
                _sweep(arm, motion),
                at_least=0.83 * self.size * where.scale,
            ),
            *usual_claims(
                motion,
                speed=(least / change.pace, largest / change.pace),
                sigma_min=0.9 * where.sigma_min,
                margin=0.5,
            ),
        )
        return Case(reference, q0, motion, claims, robot=arm)

    def _largest(self, robot: Robot, change: Perturbation) -> Case:
        """Make the largest sweep about the start of a robot that certifies."""
        reason = ""
        for share in SHARES:
            try:
                case = self._about_start(robot, change, share, 1.0)
                Certificate(case.claims).check(robot.name)
            except DikbenchError as error:
                reason = str(error)
                continue
            if self.size == 1.0:
                return case
            return self._about_start(robot, change, share, self.size)
        raise DikbenchError(
            f"no sweep about the start of robot {robot.name} can be followed; the smallest one "
            f"tried: {reason}"
        )

    def _about_start(self, robot: Robot, change: Perturbation, share: float, size: float) -> Case:
        """Make the sweep whose middle is the start, a share of the reach and of its rotation."""
        start, tilt = placement_of(robot, robot.q0), 1.0 if 2 in robot.movable_rows else 0.0
        scale, turn = share * robot.reach_of(start), share * pi / 4
        x, y, _ = start.translation - robot.shoulder
        # The middle of the original is in the direction y from the base.
        yaw = float(np.arctan2(y, x)) - pi / 2 + float(pin.log3(change.rotation(robot))[2])
        offset = scale * pin.utils.rotate("z", yaw) @ ((STOP_M - START_M) * [1.0, 1.0, tilt])
        first = start.translation - offset / 2
        target = _rotation(0.5, yaw, turn, tilt).T @ start.rotation
        reference = _path(first, offset, yaw, target, change.pace, size, turn, tilt)
        q0 = solve_placement(robot, reference.placement(0.0), robot.q0)
        motion = self.exact_motion(robot, reference, q0)
        claims = (
            Claim("scale of the path", size * scale, at_least=SMALLEST_SCALE),
            *usual_claims(motion, speed=(-inf, 1.0), sigma_min=0.03, margin=0.05),
        )
        return Case(reference, q0, motion, claims)


def _sweep(robot: Robot, motion: OracleMotion) -> float:
    """Compute the largest distance [m] of the task frame from where it starts."""
    points = np.array([placement_of(robot, q).translation for q in motion.q[::4]])
    return float(np.linalg.norm(points - points[0], axis=1).max())


def _rotation(share: float, yaw: float, turn: float, tilt: float) -> Array:
    """Compute the rotation of the path (3, 3) at a share of the sweep (see `_path`)."""
    inclined: Array = pin.utils.rotate("z", yaw + turn * (1 + share)) @ pin.utils.rotate(
        "x", turn * tilt * share
    )
    return inclined


def _path(
    first: Array,
    offset: Array,
    yaw: float,
    target: Array,
    pace: float,
    size: float,
    turn: float = pi / 4,
    tilt: float = 1.0,
) -> Reference:
    """Sweep from a point and back.

    Args:
        first: the first point, (3,) [m].
        offset: from it to the last one, (3,) [m].
        yaw: turns the orientations about the vertical [rad].
        target: R_t, (3, 3).
        pace: factor on the time.
        size: share of the way between the points that is swept, in its middle.
        turn: rotation of the sweep about the vertical [rad].
        tilt: rotation about the path's x over it.
    """
    up, forward = np.array([0.0, 0.0, 1.0]), np.array([1.0, 0.0, 0.0])

    def placement(tau: float) -> Any:
        share = (1 - size) / 2 + size * float(np.sin(tau / pace)) ** 2
        return pin.SE3(_rotation(share, yaw, turn, tilt) @ target, first + share * offset)

    def velocity(tau: float) -> Array:
        share = (1 - size) / 2 + size * float(np.sin(tau / pace)) ** 2
        rate = size * float(np.sin(2 * tau / pace)) / pace
        inclined = _rotation(share, yaw, turn, tilt)
        # Rz(a) Rx(b) turns at a' about the vertical and at b' about its own x.
        world = np.array([offset, turn * (up + tilt * (inclined @ forward))])
        twist: Array = rate * (world @ inclined @ target).ravel()
        return twist

    return Reference(pace * DURATION_S, placement, velocity, period=pace * pi)
