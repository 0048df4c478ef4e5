"""A start inside the limits and away from singularities, for a robot that comes without one."""

from __future__ import annotations

from math import pi
from typing import Final

import numpy as np
import pinocchio as pin

from dikbench.arrays import Array
from dikbench.robots.kinematics import Kinematics, smallest_singular_value
from dikbench.robots.robot import Robot

POSTURES: Final = 64
"""Number of seeded postures that are tried."""

SPREAD: Final = 0.6
"""Share of the half ranges about their middles in which they are drawn."""

SAFE_MARGIN_RAD: Final = 0.5
"""A posture this far from all limits (see `Robot.joint_scale`) is no better farther away."""

HALF_TURN: Final = pi
"""A range that is longer than two of these, or has no end, is cut to as much on each side of its
point nearest to zero [rad or m]."""


def safe_start(robot: Robot) -> Array:
    """Choose a well-conditioned posture (nq,) away from the limits, of 64 seeded ones.

    It has the largest smallest singular value of the task Jacobian, its
    columns per `Robot.joint_scale`, times the smallest distance to
    a limit where that is below `SAFE_MARGIN_RAD`. Joints that do not move the task frame are in the
    middle of their ranges.
    """
    model, limits = robot.model, robot.limits
    assert limits.position is not None
    nearest = np.clip(0.0, limits.position.lower, limits.position.upper)
    sliding = robot.joint_scale != 1.0
    reach = np.where(sliding, np.inf, HALF_TURN)
    lower = np.maximum(limits.position.lower, nearest - reach)
    upper = np.minimum(limits.position.upper, nearest + reach)
    middle, half = (lower + upper) / 2, (upper - lower) / 2
    moving = np.isin(np.arange(robot.nv), robot.chain)
    neutral, kinematics = pin.neutral(model), Kinematics(robot)
    limited = np.isfinite(limits.position.upper) & (limits.q_index >= 0)
    random = np.random.default_rng(0)
    best, most = neutral, -1.0
    for sample in range(POSTURES):
        spread = 0.0 if sample == 0 else SPREAD
        x = middle + spread * moving * half * random.uniform(-1, 1, model.nv)
        q = pin.integrate(model, neutral, np.where(limited, 0.0, x))
        q[limits.q_index[limited]] = x[limited]
        q = robot.inside(q)
        kinematics.update(q)
        at = limits.at(q)
        assert at.to_lower is not None
        assert at.to_upper is not None
        margin = (np.minimum(at.to_lower, at.to_upper) / robot.joint_scale)[robot.chain].min()
        J = kinematics.task_jacobian() * robot.joint_scale
        sigma = smallest_singular_value(J[:, robot.chain])
        merit = sigma * min(float(margin) / SAFE_MARGIN_RAD, 1.0)
        if merit > most:
            best, most = q, merit
    start: Array = best
    return start
