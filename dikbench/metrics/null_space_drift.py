"""Drift in the null space over laps of a path: whether the joints return with the frame."""

from __future__ import annotations

from math import floor
from typing import Final

import numpy as np
import pinocchio as pin

from dikbench.arrays import Array
from dikbench.metrics.metric import INF, Metric
from dikbench.metrics.motion import Motion

PHASES_PER_LAP: Final = 8
"""Number of phases of a lap at which configurations are compared."""


def null_space_drift(motion: Motion) -> float:
    """Compute the mean distance of configurations at the same phase of consecutive laps [rad].

        mean over tau of |q(tau + P) (-) q(tau)|,   tau = t_0, t_0 + P/8, t_0 + 2 P/8, ...

    as long as tau + P is reached, with P the period of the reference and t_0 the beginning of its
    first lap; of the joints that move the task frame, interpolated between control steps. NaN where
    the reference has no laps, the run does not complete one, or the task has no null space.
    """
    reference, robot = motion.scenario.reference, motion.scenario.robot
    tau, period = motion.trace.tau, reference.period
    # The last step of a run ends within half a control period of its nominal end, or the target
    # rests there already.
    whole = (
        min(float(tau[-1]), reference.duration)
        + 0.5 * motion.trace.dt
        - reference.first_lap
        - period
    )
    if not whole >= 0 or len(robot.chain) <= len(motion.scenario.rows):
        return float("nan")
    count = floor(whole / period * PHASES_PER_LAP) + 1
    starts = reference.first_lap + period / PHASES_PER_LAP * np.arange(count)
    drifts = []
    for start in starts.tolist():
        moved = pin.difference(robot.model, _at(motion, start), _at(motion, start + period))
        drifts.append(np.linalg.norm(moved[robot.chain]))
    return float(np.mean(drifts))


def _at(motion: Motion, tau: float) -> Array:
    """Return the configuration when the reference is first at a nominal time [s], (nq,)."""
    trace = motion.trace
    after = min(max(int(np.searchsorted(trace.tau, tau)), 1), trace.steps)
    span = trace.tau[after] - trace.tau[after - 1]
    share = (tau - trace.tau[after - 1]) / span if span > 0 else 1.0
    step = min(max(share, 0.0), 1.0) * trace.dt * trace.applied[after - 1]
    q: Array = pin.integrate(motion.scenario.robot.model, trace.q[after - 1], step)
    return q


NULL_SPACE_DRIFT = (
    Metric(
        "null_space_drift_per_lap_rad", "rad", "low", INF,
        "mean distance of the configurations at the same phase of consecutive laps",
        null_space_drift,
        "[KleinHuang1983]",
    ),
)  # fmt: skip
