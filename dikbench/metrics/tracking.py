"""How far the task frame is from its target, and how it gets there."""

from __future__ import annotations

from math import pi
from typing import Final

import numpy as np

from dikbench.metrics.metric import INF, Metric, largest, last, mean, percentile_95, rms
from dikbench.metrics.motion import Motion
from dikbench.problem.progress import STUCK_PROGRESS, off_course, row_weights

RECOVERED: Final = 1e-3
"""Below this position error [m] a frame is back at its target."""


def off_course_max(motion: Motion) -> float:
    """Largest angle between the achieved and the wanted twist [rad]."""
    weights = row_weights(motion.scenario.rows)
    return largest(off_course(motion.trace.wanted, motion.achieved, weights))


def recovery_time(motion: Motion) -> float:
    """Time from the largest position error until it stays below `RECOVERED` [s].

    NaN where it never was above; infinite where it is above at the end.
    """
    error = motion.position_error
    away = np.flatnonzero(error > RECOVERED)
    if not len(away):
        return float("nan")
    if away[-1] == len(error) - 1:
        return INF
    return float(away[-1] + 1 - error.argmax()) * motion.trace.dt


def path_length(motion: Motion) -> float:
    """Length of the way of the task frame's origin [m]."""
    return float(np.linalg.norm(np.diff(motion.translations, axis=0), axis=1).sum())


TRACKING = (
    Metric(
        "position_error_rms_m", "m", "low", INF, "tracking error",
        "root mean square distance of the task frame from its target",
        lambda m: rms(m.position_error),
    ),
    Metric(
        "position_error_p95_m", "m", "low", INF, "tracking error",
        "95 % quantile of the distance of the task frame from its target",
        lambda m: percentile_95(m.position_error),
    ),
    Metric(
        "position_error_max_m", "m", "low", INF, "tracking error",
        "largest distance of the task frame from its target",
        lambda m: largest(m.position_error),
    ),
    Metric(
        "position_error_final_m", "m", "low", INF, "tracking error",
        "distance of the task frame from its target at the end",
        lambda m: last(m.position_error),
    ),
    Metric(
        "orientation_error_rms_rad", "rad", "low", INF, "tracking error",
        "root mean square angle between the task frame and its target",
        lambda m: rms(m.orientation_error),
    ),
    Metric(
        "orientation_error_p95_rad", "rad", "low", INF, "tracking error",
        "95 % quantile of the angle between the task frame and its target",
        lambda m: percentile_95(m.orientation_error),
    ),
    Metric(
        "orientation_error_max_rad", "rad", "low", INF, "tracking error",
        "largest angle between the task frame and its target",
        lambda m: largest(m.orientation_error),
    ),
    Metric(
        "orientation_error_final_rad", "rad", "low", INF, "tracking error",
        "angle between the task frame and its target at the end",
        lambda m: last(m.orientation_error),
    ),
    Metric(
        "second_task_error_rms", "", "low", INF, "tracking error",
        "root mean square error of the second task [m, rad], where there is one",
        lambda m: rms(m.second_task_error),
    ),
    Metric(
        "second_task_error_final", "", "low", INF, "tracking error",
        "error of the second task [m, rad] at the end, where there is one",
        lambda m: last(m.second_task_error),
    ),
    Metric(
        "recovery_time_s", "s", "low", INF, "tracking error",
        "time from the largest position error until it stays below 1 mm; inf where it never does",
        recovery_time,
    ),
    Metric(
        "path_length_m", "m", "low", INF, "tracking error",
        "length of the way that the origin of the task frame went",
        path_length,
    ),
    Metric(
        "off_course_max_rad", "rad", "low", pi, "tracking error",
        "largest angle between the achieved and the wanted twist (L = 0.2 m)",
        off_course_max,
    ),
    Metric(
        "progress_mean", "", "high", -INF, "tracking error",
        "mean of <V_a, V>/|V|^2, the share of the wanted motion that was made (L = 0.2 m)",
        lambda m: mean(m.progress),
    ),
    Metric(
        "progress_min", "", "high", -INF, "tracking error",
        "smallest share of the wanted motion; negative is a reversal",
        lambda m: -largest(-m.progress),
    ),
    Metric(
        "stuck_share", "", "low", 1.0, "tracking error",
        "share of the steps with something wanted that made less than 1 % of it",
        lambda m: mean(m.progress < STUCK_PROGRESS),
    ),
    Metric(
        "joint_travel_rad", "rad", "low", INF, "tracking error",
        "sum of the distances that the joints moved",
        lambda m: float(np.abs(m.trace.applied).sum() * m.trace.dt),
    ),
    Metric(
        "sigma_min", "", "high", 0.0, "tracking error",
        "smallest singular value of the task Jacobian (m, rad) on the way",
        lambda m: m.sigma_min,
        "[KleinBlaho1987]",
    ),
)  # fmt: skip
