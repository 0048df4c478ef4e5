"""Chatter: joints whose velocity jumps back and forth from step to step, or that shake."""

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


SHAKING_FREQUENCY_HZ: Final = 10.0
"""A joint shakes that reverses at this frequency: no path asks for motion above it."""

SHAKING_PERIODS: Final = 2
"""So many periods in a row are shaking: one is a corner."""

SHAKING_AMPLITUDE: Final = 0.01
"""Reversals count that change a velocity by this share of its limit: solvers err by far less."""


def chattering(motion: Motion) -> Mask:
    """Find the steps in which a joint chatters, of the whole run, (n,): it jumps, or it shakes."""
    return _jumping(motion) | _shaking(motion)


def _jumping(motion: Motion) -> Mask:
    """Find the steps in which a joint jumps back, (n,).

    Its velocity jumps one way and, within `LONGEST_PERIOD_STEPS` steps, the other way, with nothing
    but smaller changes between, both times by more than a dt, with a its acceleration limit where
    one is known, otherwise its speed limit over 0.1 s.
    """
    jumps = motion.jumps
    large = np.abs(jumps) > largest_acceleration(motion.scenario.robot) * motion.trace.dt
    if not large.any():
        return np.zeros(len(jumps), dtype=bool)
    signs = np.where(large, np.sign(jumps), 0.0)
    steps = np.arange(len(jumps))[:, None]
    # The last jump before each step, by its number; -1 where there was none.
    last = np.maximum.accumulate(np.where(large, steps, -1), axis=0)
    before = np.vstack([np.full((1, jumps.shape[1]), -1), last[:-1]])
    turned = np.take_along_axis(signs, np.maximum(before, 0), axis=0) * signs < 0
    mask: Mask = (turned & (before >= 0) & (steps - before <= LONGEST_PERIOD_STEPS)).any(axis=1)
    return mask


def _shaking(motion: Motion) -> Mask:
    """Find the steps in which a joint shakes, (n,), within its acceleration limit or not.

    They are those from a reversal of its velocity to the one `SHAKING_PERIODS` periods later, where
    these take at most as long as at `SHAKING_FREQUENCY_HZ`. A reversal is an extremum before and
    after which the velocity changes by more than `SHAKING_AMPLITUDE` of its limit.
    """
    mask: Mask = np.zeros(motion.trace.steps, dtype=bool)
    limit = motion.scenario.robot.limits.velocity
    if limit is None:
        return mask
    number = 2 * SHAKING_PERIODS
    longest = SHAKING_PERIODS / (SHAKING_FREQUENCY_HZ * motion.trace.dt) * (1 + RELATIVE_ROUNDING)
    jumps = motion.jumps
    # Every extremum is at one of these, and every reversal at an extremum.
    places, joints = np.nonzero(jumps[1:] * jumps[:-1] <= 0)
    for joint in range(jumps.shape[1]) if len(places) > number else ():
        near = places[joints == joint]
        if len(near) <= number or (near[number:] - near[:-number]).min() > longest:
            continue
        turned = _reversals(motion.velocities[:, joint], SHAKING_AMPLITUDE * limit.upper[joint])
        for start, end in zip(turned, turned[number:], strict=False):
            if end - start <= longest:
                mask[max(start - 1, 0) : end] = True
    return mask


def _reversals(values: Array, least: float) -> list[int]:
    """Find the extrema before and after which values (n,) change by more than `least`, in order."""
    slopes = np.sign(np.diff(values))
    moving = np.flatnonzero(slopes)
    extrema = moving[1:][slopes[moving[1:]] != slopes[moving[:-1]]]
    found: list[int] = []
    high = low = direction = 0
    for place in (*extrema.tolist(), len(values) - 1):
        high = place if values[place] > values[high] else high
        low = place if values[place] < values[low] else low
        if direction >= 0 and values[high] - values[place] > least:
            found += [high] * (direction > 0)
            direction, low = -1, place
        elif direction <= 0 and values[place] - values[low] > least:
            found += [low] * (direction < 0)
            direction, high = 1, place
    return found


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
    "chatter", "", "in which a joint's velocity jumps back within 2 steps or shakes at 10 Hz",
    chattering, "share", "steps",
)  # fmt: skip
