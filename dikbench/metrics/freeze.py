"""Freezes: the robot stands still while its target moves on."""

from __future__ import annotations

from typing import Final

import numpy as np

from dikbench.arrays import Array
from dikbench.metrics.metric import INF, Metric
from dikbench.metrics.motion import Motion

STILL: Final = 1e-6
"""Displacement up to which a joint has not moved [rad or m]."""

TARGET_MOVED_M: Final = 5e-3
"""A target that is farther than this from where it was has moved."""


def freeze_events(motion: Motion) -> float:
    """Count the times at which the robot freezes: one for as long as it lasts.

    No joint moves by more than 1e-6 rad or m from where it was, while the target moves more than
    5 mm away from where it was then, in position and orientation (see `Embedding`).
    """
    trace, targets = motion.trace, motion.target_points
    still = np.append((np.abs(trace.applied) * trace.dt <= STILL).all(axis=1), False)
    events = 0
    ends = np.flatnonzero(np.diff(still.astype(int), prepend=0))
    for start, end in zip(ends[::2], ends[1::2], strict=True):
        events += _in_still_steps(trace.applied[start:end] * trace.dt, targets[start : end + 1])
    return float(events)


def _in_still_steps(steps: Array, targets: Array) -> int:
    """Count the freezes among steps (k, nv) so small that each may be part of one.

    Args:
        steps: displacements of the joints [rad or m].
        targets: before each step and after the last one, (k + 1, d) [m].
    """
    if np.linalg.norm(np.ptp(targets, axis=0)) <= TARGET_MOVED_M:
        return 0  # as in the rest at the end of a run
    events, first, counted = 0, 0, False
    way = np.zeros(steps.shape[1])
    for k, step in enumerate(steps, start=1):
        way += step
        if (np.abs(way) > STILL).any():
            first, counted = k, False
            way[:] = 0.0
        elif not counted and np.linalg.norm(targets[k] - targets[first]) > TARGET_MOVED_M:
            events, counted = events + 1, True
    return events


FREEZE = (
    Metric(
        "freeze_events", "", "low", INF,
        "times at which no joint moved more than 1e-6 rad or m while the target moved over 5 mm "
        "(L = 0.2 m)",
        freeze_events,
    ),
)  # fmt: skip
