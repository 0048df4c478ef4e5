"""Tracking errors, progress and direction errors of the task frame."""

from __future__ import annotations

from math import pi
from typing import Final

import numpy as np

from dikbench.metrics.metric import INF, Metric, series_metrics
from dikbench.metrics.motion import Motion
from dikbench.problem.progress import STUCK_PROGRESS

RECOVERED_POSITION_ERROR_M: Final = 1e-3
"""Position error below which a frame has recovered."""


def recovery_time(motion: Motion) -> float:
    """Compute the time from the largest position error until it stays below 1 mm [s].

    NaN where it never was above; infinite where it is above at the end.
    """
    error = motion.position_error
    away = np.flatnonzero(error > RECOVERED_POSITION_ERROR_M)
    if not len(away):
        return float("nan")
    if away[-1] == len(error) - 1:
        return INF
    return float(away[-1] + 1 - error.argmax()) * motion.trace.dt


def path_length(motion: Motion) -> float:
    """Compute the length of the path that the origin of the task frame covered [m]."""
    return float(np.linalg.norm(np.diff(motion.translations, axis=0), axis=1).sum())


TRACKING = (
    *series_metrics(
        "position_error", "m", "distance of the task frame from its target",
        lambda m: m.position_error, "rms", "p95", "max", "final",
    ),
    *series_metrics(
        "orientation_error", "rad", "angle between the task frame and its target",
        lambda m: m.orientation_error, "rms", "p95", "max", "final",
    ),
    *series_metrics(
        "second_task_error", "", "error of the second task [m, rad], where there is one",
        lambda m: m.second_task_error, "rms", "final",
    ),
    Metric(
        "recovery_time_s", "s", "low", INF,
        "time from the largest position error until it stays below 1 mm; inf where it never does",
        recovery_time,
    ),
    Metric(
        "path_length_m", "m", "low", INF,
        "length of the path that the origin of the task frame covered", path_length,
    ),
    *series_metrics(
        "direction_error", "rad",
        "angle between J v and the twist that the task asks for there (L = 0.2 m): 0 for J^+ V",
        lambda m: m.direction_error, "max", worst=pi,
    ),
    *series_metrics(
        "progress", "",
        "share of the desired motion made in a step, <V_a, V>/|V|^2 (L = 0.2 m), < 0 in reverse",
        lambda m: m.progress, "mean", "min", best="high",
    ),
    *series_metrics(
        "stuck", "", "with a desired motion that make less than 1 % of it",
        lambda m: m.progress < STUCK_PROGRESS, "share",
    ),
    Metric(
        "joint_travel_rad", "rad", "low", INF, "sum of the distances that the joints moved",
        lambda m: float(np.abs(m.trace.applied).sum() * m.trace.dt),
    ),
    Metric(
        "sigma_min", "", "high", 0.0,
        "smallest singular value of the task Jacobian (m, rad) during the motion",
        lambda m: m.sigma_min, "[KleinBlaho1987]",
    ),
)  # fmt: skip
