"""Limits and distances that a motion breaks: what counts, and where it does so first."""

from __future__ import annotations

from typing import Final, Literal, NamedTuple

import numpy as np

from dikbench.arrays import Array, Mask
from dikbench.robots.limits import JointLimits
from dikbench.robots.robot import Robot
from dikbench.scenario.witness import outside

COLLISION_TOLERANCE_M: Final = 1e-3
"""A distance may fall short of its margin by this."""

SPEED_TOLERANCE: Final = 1.001
"""Joint speeds may be this many times their limit."""

ACCELERATION_TOLERANCE: Final = 1.01
"""Joint accelerations may be this many times theirs."""

TORQUE_TOLERANCE: Final = 1.001
"""Joint torques may be this many times theirs."""

POSITION_TOLERANCE: Final = 1e-3
"""A joint may be so far outside its position limits [rad or m]."""


class Violation(NamedTuple):
    """A limit or a distance that is broken.

    Attributes:
        kind: what came of it.
        step: number of the step, or of the instant, at which it is first broken.
        figure: how far, in what `reason` says.
        reason: the quantity.
    """

    kind: Literal["collided", "limit-broken"]
    step: int
    figure: float
    reason: str


def collision(clearance: Array) -> Violation | None:
    """Find the first collision.

    Args:
        clearance: distance less its margin at each instant, (n + 1,) [m]; empty without obstacles.
    """
    hit = clearance < -COLLISION_TOLERANCE_M
    if not hit.any():
        return None
    return _first("collided", hit, -clearance, "distance [m] below its margin")


def broken_limit(
    robot: Robot, q: Array, back_inside: Mask, v: Array, accelerations: Array, torque_usage: Array
) -> Violation | None:
    """Find the first broken limit of the joints.

    Args:
        robot: the robot, with the limits in force.
        q: configurations at the instants, the first at the start of the run, (n + 1, nq).
        back_inside: whether a joint that started outside must be back inside by then, (n + 1,).
        v: velocities in the steps, (n, nv) [rad/s or m/s].
        accelerations: into the steps, (n, nv) [rad/s^2 or m/s^2].
        torque_usage: largest torque over its limit in the steps, (n,); empty without torque limits.
    """
    found = [
        _first("limit-broken", values > most, values, reason)
        for values, most, reason in _shares(robot.limits, v, accelerations, torque_usage)
        if (values > most).any()
    ]
    beyond = outside(robot, q, back_inside, POSITION_TOLERANCE)
    if (beyond > 0).any():
        reason = "distance [rad or m] of a joint outside its range"
        found.append(_first("limit-broken", beyond > 0, _out_of_range(robot.limits, q), reason))
    return min(found, key=lambda violation: violation.step) if found else None


def _out_of_range(limits: JointLimits, q: Array) -> Array:
    """Compute how far the farthest joint is outside its range, (n + 1,) [rad or m]."""
    assert limits.position is not None
    values = q[:, limits.q_index]
    excess = np.maximum(values - limits.position.upper, limits.position.lower - values)
    farthest: Array = np.where(limits.q_index >= 0, excess, -np.inf).max(axis=1)
    return farthest


def _shares(
    limits: JointLimits, v: Array, accelerations: Array, torque_usage: Array
) -> list[tuple[Array, float, str]]:
    """Return speed, acceleration and torque over their limits in each step, (n,); and the most."""
    shares = []
    if limits.velocity is not None:
        usage = limits.velocity.usage(v).max(axis=1, initial=0.0)
        shares.append((usage, SPEED_TOLERANCE, "joint speed over its limit"))
    if limits.acceleration is not None:
        usage = limits.acceleration.usage(accelerations).max(axis=1, initial=0.0)
        shares.append((usage, ACCELERATION_TOLERANCE, "joint acceleration over its limit"))
    if len(torque_usage):
        shares.append((torque_usage, TORQUE_TOLERANCE, "joint torque over its limit"))
    return shares


def _first(
    kind: Literal["collided", "limit-broken"], mask: Mask, values: Array, reason: str
) -> Violation:
    """Name the first of the instants of a mask."""
    step = int(mask.argmax())
    return Violation(kind, step, float(values[step]), reason)
