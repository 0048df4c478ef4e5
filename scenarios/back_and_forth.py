"""The trajectory of pink_bench: a wide sweep of position and orientation, back and forth."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from math import pi
from types import MappingProxyType
from typing import Any, Literal

import numpy as np
import pinocchio as pin

from dikbench.problem import Array, Robot
from dikbench.scenario import (
    Case,
    Claim,
    Family,
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

        p = scale (start + (stop - start) sin^2 t),
        R = Rz(pi/4 (1 + sin^2 t)) Rx(pi/4 sin^2 t) R_t

    with start (0.4, 0.8, 0.4) m, stop (-0.4, 0.6, 0.6) m. UR3, UR5 and UR10 have the frame
    `ee_link`, R_t = I and scale 0.5, 0.9, 1.0; the Panda `panda_hand`, Rx(pi/2) and 0.7. In the
    original the arms first move to the path; here they start on it. A seed turns the whole
    path about the vertical by up to 0.2 rad and changes its pace by up to 10 %.

    Provokes: a wide and steady sweep, inside all limits

    Shows in: position_error_rms_m, orientation_error_rms_rad

    Attributes:
        robot: one of these robots, with its own frame.

    Source: pink_bench (Caron), back-and-forth trajectory.
    """

    robot: Literal["ur3", "ur5", "ur10", "panda"] = "ur5"
    frame: None = None
    dt: float = 0.005

    variation = Variation(direction=0.2, timing=0.1)

    def case(self, robot: Robot, change: Perturbation) -> Case:
        """See `Family`."""
        where = SET_UPS[self.robot]
        arm = replace(robot, frame=where.frame)
        # A rotation of the path about another axis would leave the reach.
        yaw = float(pin.log3(change.rotation(arm))[2])
        reference = _path(where, yaw, change.pace)
        q0 = solve_placement(arm, reference.placement(0.0), np.array(where.near))
        motion = self.exact_motion(arm, reference, q0)
        points = np.array([placement_of(arm, q).translation for q in motion.q[::4]])
        sweep = np.linalg.norm(points - points[0], axis=1).max()
        least, largest = where.speed
        claims = (
            Claim("sweep from end to end [m]", sweep, at_least=0.83 * where.scale),
            *usual_claims(
                motion,
                speed=(least / change.pace, largest / change.pace),
                sigma_min=0.9 * where.sigma_min,
                margin=0.5,
            ),
        )
        return Case(reference, q0, motion, claims, robot=arm)


def _path(where: SetUp, yaw: float, pace: float) -> Reference:
    turned, target = pin.utils.rotate("z", yaw), pin.utils.rotate("x", where.roll)
    first = turned @ (where.scale * START_M)
    offset = turned @ (where.scale * (STOP_M - START_M))
    up, forward = np.array([0.0, 0.0, 1.0]), np.array([1.0, 0.0, 0.0])

    def rotation(share: float) -> Array:
        inclined: Array = pin.utils.rotate("z", yaw + pi / 4 * (1 + share)) @ pin.utils.rotate(
            "x", pi / 4 * share
        )
        return inclined

    def placement(tau: float) -> Any:
        share = float(np.sin(tau / pace)) ** 2
        return pin.SE3(rotation(share) @ target, first + share * offset)

    def velocity(tau: float) -> Array:
        share = float(np.sin(tau / pace)) ** 2
        rate = float(np.sin(2 * tau / pace)) / pace
        inclined = rotation(share)
        # Rz(a) Rx(b) turns at a' about the vertical and at b' about its own x.
        world = np.array([offset, pi / 4 * (up + inclined @ forward)])
        twist: Array = rate * (world @ inclined @ target).ravel()
        return twist

    return Reference(pace * DURATION_S, placement, velocity, period=pace * pi)
