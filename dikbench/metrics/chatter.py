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

LONGEST_PERIOD_STEPS: Final = 2
"""A joint chatters that jumps back within so many steps: two steps up and two down are no better
than one. With 5 the exact motion of a fast pick and place does."""

RELATIVE_ROUNDING: Final = 1e-9
"""A jump at the acceleration limit itself, to within this share of it, does not exceed it."""


def chattering(motion: Motion) -> Mask:
    """Find the steps in which a joint chatters, of the whole run, (n,).

    Its velocity jumps one way and, within `LONGEST_PERIOD_STEPS` steps, the other way, with nothing
    but smaller changes between, both times by more than a dt, with a its acceleration limit where
    one is known, otherwise its speed limit over 0.1 s.
    """
    jumps = np.diff(motion.velocities, axis=0)
    large = np.abs(jumps) > largest_acceleration(motion.scenario.robot) * motion.trace.dt
    if not len(jumps):
        return np.zeros(0, dtype=bool)
    signs = np.where(large, np.sign(jumps), 0.0)
    steps = np.arange(len(jumps))[:, None]
    # The last jump before each step, by its number; -1 where there was none.
    last = np.maximum.accumulate(np.where(large, steps, -1), axis=0)
    before = np.vstack([np.full((1, jumps.shape[1]), -1), last[:-1]])
    turned = np.take_along_axis(signs, np.maximum(before, 0), axis=0) * signs < 0
    mask: Mask = (turned & (before >= 0) & (steps - before <= LONGEST_PERIOD_STEPS)).any(axis=1)
    return mask


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
    "chatter", "", "in which a joint's velocity jumps back within 2 steps",
    chattering, "share", "steps",
)  # fmt: skip
