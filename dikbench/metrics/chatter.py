"""Chatter: joints whose velocity jumps back and forth from step to step."""

from __future__ import annotations

from typing import Final

import numpy as np

from dikbench.arrays import Array, Mask
from dikbench.metrics.metric import series_metrics
from dikbench.metrics.motion import Motion
from dikbench.robots.robot import Robot

TIME_TO_FULL_SPEED_S: Final = 0.1
"""A joint without a known acceleration limit is taken to reach its speed limit in this time."""

RELATIVE_ROUNDING: Final = 1e-9
"""A jump at the acceleration limit itself, to within this share of it, does not exceed it."""


def chattering(motion: Motion) -> Mask:
    """Find the steps in which a joint chatters, of those until the reference ends, (k,).

    Its velocity changes one way and then, in the next step, the other way, dv_k dv_(k-1) < 0, both
    times by more than a dt, with a its acceleration limit where one is known, otherwise its speed
    limit over 0.1 s.
    """
    trace = motion.trace
    jumps = np.diff(motion.velocities, axis=0)
    large = np.abs(jumps) > largest_acceleration(motion.scenario.robot) * trace.dt
    mask = np.zeros(len(jumps), dtype=bool)
    mask[1:] = (large[1:] & large[:-1] & (jumps[1:] * jumps[:-1] < 0)).any(axis=1)
    before_end = trace.tau[:-1] < motion.scenario.reference.duration - 0.5 * trace.dt
    return mask[before_end]


def largest_acceleration(robot: Robot) -> Array:
    """Return the accelerations above which a change of velocity is a jump, (nv,) [rad/s^2]."""
    known, velocity = robot.available_acceleration, robot.limits.velocity
    in_force = robot.limits.acceleration
    if in_force is not None:
        largest = np.maximum(in_force.upper, -in_force.lower)
    elif known is not None:
        largest = known
    elif velocity is not None:
        largest = np.maximum(velocity.upper, -velocity.lower) / TIME_TO_FULL_SPEED_S
    else:
        largest = np.full(robot.nv, np.inf)
    return largest * (1 + RELATIVE_ROUNDING)


CHATTER = series_metrics(
    "chatter", "", "until the reference ends in which a joint's velocity jumps back and forth",
    chattering, "share", "steps",
)  # fmt: skip
