"""A base that turns and translates at once, with a small weight on the orientation."""

from __future__ import annotations

from dataclasses import dataclass
from math import pi
from typing import Annotated, Any, Literal

import numpy as np
import pinocchio as pin

from dikbench.errors import DikbenchError
from dikbench.problem import Array, Drawn, PoseTask, Range, Robot
from dikbench.scenario import (
    Case,
    Claim,
    NamedRobotFamily,
    Perturbation,
    Reference,
    Time,
    Variation,
    joint_oracle,
    placement_of,
    samples,
)


@dataclass(frozen=True, kw_only=True)
class LogDerivativeDrift(NamedRobotFamily):
    """A square wave of poses for a mobile base: back by `distance` and turned by `turn`, twice.

    The target is the start for `hold` seconds, then `distance` behind it with a yaw of `turn`, then
    both again; the position has a cost of 1, the orientation one of `orientation_cost` (a weight is
    a cost squared). A formulation without the derivative of the logarithm makes a detour where
    damping competes with the small weight; with it the base moves straight. The ideal path length
    is three times the distance. A seed moves start and poses by up to 0.05 (m, rad), turns the
    direction of the second pose by up to 0.5 rad and changes the times by up to 10 %.

    Provokes: detours of formulations that leave out the derivative of the logarithm

    Shows in: path_length_m

    Attributes:
        distance: distance between the two poses.
        turn: yaw between them, 2 to 3 rad either way (not pi, where the logarithm jumps).
        orientation_cost: cost of the orientation; the position's is 1.
        hold: time for which each pose is the target.

    Source: Caron's note on the logarithm's derivative in Pink (a planar base that drifts).
    """

    robot: Literal["base"] = "base"
    acceleration: Literal[False] = False
    distance: Annotated[float, Range(0.05, 1.0, "m"), Drawn(0.1, 0.5)] = 0.2
    turn: Annotated[float, Range(-3.0, 3.0, "rad"), Drawn(-3.0, -2.2)] = -0.9 * pi
    orientation_cost: Annotated[float, Range(1e-6, 1e-3), Drawn(1e-6, 1e-4, log=True)] = 1e-5
    hold: Time = 2.0

    variation = Variation(start=0.05, direction=0.5, timing=0.1)

    def check(self) -> None:
        """Check that the yaw is large, either way."""
        if abs(self.turn) < 2.0:
            raise DikbenchError(f"turn={self.turn} must be -3 to -2 or 2 to 3 [rad]")

    def case(self, robot: Robot, change: Perturbation) -> Case:
        """See `Family`."""
        period, q0 = self.hold * change.pace, change.posture(robot, robot.q0)
        back = change.rotation(robot) @ np.array([-self.distance, 0.0, 0.0])
        first = placement_of(robot, q0)
        poses = (first, first * pin.SE3(pin.utils.rotate("z", self.turn), back))

        def placement(tau: float) -> Any:
            return poses[min(int(tau / period + 1e-9), 3) % 2]  # the last one stays until the end

        def straight(tau: float) -> Array:
            """Move each leg at constant rates of x, y and yaw, in half of its time."""
            leg = min(int(tau / period), 3)
            if leg == 0:
                return q0
            share = min(2 * (tau / period - leg), 1.0)
            along = share if leg % 2 else 1.0 - share
            yaw = np.arctan2(q0[3], q0[2]) + along * self.turn
            x, y, _ = first.act(along * back)
            return np.array([x, y, np.cos(yaw), np.sin(yaw)])

        motion = joint_oracle(robot, straight, samples(4 * period, self.dt))
        length = np.linalg.norm(np.diff(motion.q[:, :2], axis=0), axis=1).sum() / self.distance
        screw = pin.log6(first.actInv(poses[1]))
        detour = _length(screw) / self.distance
        claims = (
            Claim("length of the straight way over the distance", length, 2.99, 3.01),
            # Damping increases the detour of the screw.
            Claim("length of the screw over the distance", detour, 1.15),
            Claim("yaw between the poses [rad]", abs(screw.angular[2]), at_most=3.05),
        )
        tracking, zero = (
            PoseTask(gain=self.gain, weight=np.array([1.0, 1.0, self.orientation_cost**2])),
            np.zeros(6),
        )
        reference = Reference(4 * period, placement, lambda tau: zero, moving=False)
        return Case(reference, q0, motion, claims, tracking=tracking, v0=np.zeros(3))


def _length(screw: pin.Motion) -> float:
    """Compute the path length of the origin along a screw motion [m]."""
    points = np.array([pin.exp6(share * screw).translation for share in np.linspace(0.0, 1.0, 101)])
    return float(np.linalg.norm(np.diff(points, axis=0), axis=1).sum())
