"""A base that turns and goes at once, with an orientation that hardly counts."""

from __future__ import annotations

from math import pi
from typing import Any, Literal

import numpy as np
import pinocchio as pin

from dikbench.scenario import (
    Array,
    Certificate,
    Claim,
    PoseTask,
    Reference,
    Scenario,
    Variation,
    between,
    joint_oracle,
    load_robot,
    placement_of,
    positive,
    samples,
)

VARIATION = Variation(start=0.05, direction=0.5, timing=0.1)


def log_derivative_drift(
    robot: Literal["base"] = "base",
    *,
    distance: float = 0.2,
    turn: float = -0.9 * pi,
    orientation_cost: float = 1e-5,
    gain: float = 5.0,
    dt: float = 0.01,
    hold: float = 2.0,
    seed: int = 0,
) -> Scenario:
    """A square wave of poses for a mobile base: back by `distance`, turned by `turn`, and again.

    The target is the start for `hold` seconds, then `distance` behind it with a yaw of `turn`, then
    the start and the other once more; position has a cost of 1, orientation one of
    `orientation_cost` (a weight is a cost squared). A law that leaves the derivative of the
    logarithm out swings wide where damping competes with the small weight; with it the base goes
    straight. The ideal length of the way is three times the distance. A seed moves start and poses
    by up to 0.05 (m, rad), turns the direction in which the second pose lies by up to 0.5 rad and
    changes the times by up to 10 %.

    Provokes: detours of laws that leave out the derivative of the logarithm

    Shows in: path_length_m

    Args:
        robot: base.
        distance: between the two poses [m], 0.05 to 1.
        turn: yaw between them [rad], 2 to 3 either way (not pi, where the logarithm is cut).
        orientation_cost: beside a cost of 1 of the position, 1e-6 to 1e-3.
        gain: of the tracking task, 1/s.
        dt: control period [s].
        hold: how long each pose is wanted [s].
        seed: 0 perturbs nothing.

    Source: Caron's note on the logarithm's derivative in Pink (a planar base that drifts).
    """
    positive("log-derivative-drift", gain=gain, dt=dt, hold=hold)
    between("log-derivative-drift", "distance", distance, 0.05, 1.0)
    between("log-derivative-drift", "turn", abs(turn), 2.0, 3.0)
    between("log-derivative-drift", "orientation_cost", orientation_cost, 1e-6, 1e-3)
    base, change = load_robot(robot), VARIATION.drawn(seed)
    period = hold * change.pace
    q0 = change.posture(base, base.q0)
    back = change.rotation(base) @ np.array([-distance, 0.0, 0.0])
    first = placement_of(base, q0)
    poses = (first, first * pin.SE3(pin.utils.rotate("z", turn), back))

    def placement(tau: float) -> Any:
        return poses[min(int(tau / period + 1e-9), 3) % 2]  # the last one stays to the end

    zero = np.zeros(6)
    reference = Reference(4 * period, placement, lambda tau: zero, moving=False)

    def straight(tau: float) -> Array:
        """Each leg as a constant motion in x, y and yaw, in half of the time that it has."""
        leg = min(int(tau / period), 3)
        if leg == 0:
            return q0
        share = min(2 * (tau / period - leg), 1.0)
        along = share if leg % 2 else 1.0 - share
        yaw = np.arctan2(q0[3], q0[2]) + along * turn
        x, y, _ = poses[0].act(along * back)
        return np.array([x, y, np.cos(yaw), np.sin(yaw)])

    motion = joint_oracle(base, straight, samples(4 * period, dt))
    way = np.linalg.norm(np.diff(motion.q[:, :2], axis=0), axis=1).sum()
    screw = pin.log6(poses[0].actInv(poses[1]))
    certificate = Certificate(
        (
            Claim("length of the straight way over the distance", way / distance, 2.99, 3.01),
            # The detour that the screw makes is what damping widens.
            Claim("length of the screw over the distance", _length(screw) / distance, 1.15),
            Claim("yaw between the poses [rad]", abs(screw.angular[2]), at_most=3.05),
            Claim("weight of the orientation", orientation_cost**2, at_most=1.01e-6),
        )
    )
    return Scenario(
        robot=base,
        q0=q0,
        v0=np.zeros(3),
        reference=reference,
        tracking=PoseTask(gain=gain, weight=np.array([1.0, 1.0, orientation_cost**2])),
        dt=dt,
        duration=4 * period,
        certificate=certificate,
        motion=motion,
        variation=VARIATION,
    )


def _length(screw: pin.Motion) -> float:
    """Length of the way of the origin along a screw motion [m]."""
    way = np.array([pin.exp6(share * screw).translation for share in np.linspace(0.0, 1.0, 101)])
    return float(np.linalg.norm(np.diff(way, axis=0), axis=1).sum())
