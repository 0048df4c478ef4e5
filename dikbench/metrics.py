"""The metrics of a trial: pure functions of its recorded motion, never of what a solver said."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from types import MappingProxyType
from typing import Final, Literal

import numpy as np

from dikbench.array import Array, Mask
from dikbench.limits import Interval
from dikbench.motion import Motion
from dikbench.progress import STUCK_PROGRESS, off_course, progress, row_weights
from dikbench.status import Status

Table = Literal["tracking error", "limit violation"]

NEGLIGIBLE: Final = 1e-4
"""A step that passes a limit by less than this [rad, rad/s] is not counted as a violation: that is
a solver's tolerance, and its size stands in the columns beside."""


@dataclass(frozen=True)
class Metric:
    """A number that says how a trial went.

    Attributes:
        name: its column, with the unit at the end.
        unit: empty for a share or a ratio.
        best: which direction is better.
        worst: the value of a trial that came to nothing.
        table: the table in which it stands.
        definition: one line.
        of: computes it; NaN where the motion does not define it.
    """

    name: str
    unit: str
    best: Literal["low", "high"]
    worst: float
    table: Table
    definition: str
    of: Callable[[Motion], float]


def _rms(values: Array) -> float:
    return float(np.sqrt(np.mean(np.square(values)))) if len(values) else float("nan")


def _largest(values: Array) -> float:
    defined = values[~np.isnan(values)]
    return float(defined.max()) if len(defined) else float("nan")


def _weights(motion: Motion) -> Array:
    return row_weights(motion.scenario.rows)


def _off_course(motion: Motion) -> float:
    return _largest(off_course(motion.trace.wanted, motion.achieved, _weights(motion)))


def _progress(motion: Motion) -> Array:
    alpha = progress(motion.trace.wanted, motion.achieved, _weights(motion))
    return alpha[~np.isnan(alpha)]


def _progress_mean(motion: Motion) -> float:
    alpha = _progress(motion)
    return float(alpha.mean()) if len(alpha) else float("nan")


def _progress_min(motion: Motion) -> float:
    return -_largest(-_progress(motion))


def _excess(values: Array, interval: Interval | None) -> Array:
    """How far values (k, nv) lie outside an interval; 0 inside, and where none is in force."""
    if interval is None:
        return np.zeros_like(values)
    return np.maximum(np.maximum(values - interval.upper, interval.lower - values), 0.0)


def _peak_ratio(motion: Motion) -> float:
    limit = motion.scenario.robot.limits.velocity
    v = motion.trace.applied
    if limit is None or not len(v):
        return float("nan")
    return float(limit.usage(v).max())


def _position_violations(motion: Motion) -> Array:
    limits = motion.scenario.robot.limits
    return _excess(motion.trace.q[:, limits.q_index], limits.position)


def _velocity_violation(motion: Motion) -> float:
    velocity = motion.scenario.robot.limits.velocity
    return _largest(_excess(motion.trace.applied, velocity).ravel())


def _acceleration_violation(motion: Motion) -> float:
    limits, trace = motion.scenario.robot.limits, motion.trace
    v = np.vstack([motion.scenario.v0, trace.applied])
    return _largest(_excess(np.diff(v, axis=0) / trace.dt, limits.acceleration).ravel())


def _violating_share(motion: Motion) -> float:
    limit = motion.scenario.robot.limits.velocity
    outside = _position_violations(motion)[1:].max(axis=1, initial=0.0)
    too_fast = _excess(motion.trace.applied, limit).max(axis=1, initial=0.0)
    violating = np.maximum(outside, too_fast) > NEGLIGIBLE
    return float(np.mean(violating)) if len(violating) else float("nan")


def _travel(motion: Motion) -> float:
    return float(np.abs(motion.trace.applied).sum() * motion.trace.dt)


def _stuck_share(motion: Motion) -> float:
    alpha = _progress(motion)
    return float(np.mean(alpha < STUCK_PROGRESS)) if len(alpha) else float("nan")


def _share(status: Status) -> Callable[[Motion], float]:
    return lambda motion: motion.trace.share(status)


def _share_of(steps: Mask, motion: Motion) -> float:
    """The share of the steps at which something was solved; NaN where nothing ever was."""
    asked = motion.trace.claimed >= 0
    return float(np.mean(steps[asked])) if asked.any() else float("nan")


def _last(values: Array) -> float:
    return float(values[-1]) if len(values) else float("nan")


_INF = float("inf")

METRICS: Mapping[str, Metric] = MappingProxyType(
    {
        metric.name: metric
        for metric in (
            Metric(
                "position_error_rms_m", "m", "low", _INF, "tracking error",
                "root mean square distance of the task frame from its target",
                lambda m: _rms(m.position_error),
            ),
            Metric(
                "position_error_max_m", "m", "low", _INF, "tracking error",
                "largest distance of the task frame from its target",
                lambda m: _largest(m.position_error),
            ),
            Metric(
                "position_error_final_m", "m", "low", _INF, "tracking error",
                "distance of the task frame from its target at the end",
                lambda m: _last(m.position_error),
            ),
            Metric(
                "orientation_error_rms_rad", "rad", "low", _INF, "tracking error",
                "root mean square angle between the task frame and its target",
                lambda m: _rms(m.orientation_error),
            ),
            Metric(
                "orientation_error_max_rad", "rad", "low", _INF, "tracking error",
                "largest angle between the task frame and its target",
                lambda m: _largest(m.orientation_error),
            ),
            Metric(
                "orientation_error_final_rad", "rad", "low", _INF, "tracking error",
                "angle between the task frame and its target at the end",
                lambda m: _last(m.orientation_error),
            ),
            Metric(
                "second_task_error_rms", "", "low", _INF, "tracking error",
                "root mean square error of the second task [m, rad], where there is one",
                lambda m: _rms(m.second_task_error),
            ),
            Metric(
                "second_task_error_final", "", "low", _INF, "tracking error",
                "error of the second task [m, rad] at the end, where there is one",
                lambda m: _last(m.second_task_error),
            ),
            Metric(
                "path_length_m", "m", "low", _INF, "tracking error",
                "length of the way that the origin of the task frame went",
                lambda m: float(np.linalg.norm(np.diff(m.translations, axis=0), axis=1).sum()),
            ),
            Metric(
                "off_course_max_rad", "rad", "low", np.pi, "tracking error",
                "largest angle between the achieved and the wanted twist (L = 0.2 m)",
                _off_course,
            ),
            Metric(
                "progress_mean", "", "high", -_INF, "tracking error",
                "mean of <V_a, V>/|V|^2, the share of the wanted motion that was made (L = 0.2 m)",
                _progress_mean,
            ),
            Metric(
                "progress_min", "", "high", -_INF, "tracking error",
                "smallest share of the wanted motion; negative is a reversal",
                _progress_min,
            ),
            Metric(
                "velocity_peak_ratio", "", "low", _INF, "limit violation",
                "largest joint speed of the motion over its limit",
                _peak_ratio,
            ),
            Metric(
                "position_violation_max_rad", "rad", "low", _INF, "limit violation",
                "largest distance of a joint outside its position limits",
                lambda m: _largest(_position_violations(m).ravel()),
            ),
            Metric(
                "velocity_violation_max_rad_s", "rad/s", "low", _INF, "limit violation",
                "largest joint speed above its limit",
                _velocity_violation,
            ),
            Metric(
                "acceleration_violation_max_rad_s2", "rad/s^2", "low", _INF, "limit violation",
                "largest joint acceleration above its limit; 0 where none is in force",
                _acceleration_violation,
            ),
            Metric(
                "violating_share", "", "low", 1.0, "limit violation",
                "share of the steps that end outside a position limit or move too fast, by > 1e-4",
                _violating_share,
            ),
            Metric(
                "infeasible_share", "", "low", 1.0, "limit violation",
                "share of the steps whose program had no feasible point",
                _share(Status.INFEASIBLE),
            ),
            Metric(
                "solver_failed_share", "", "low", 1.0, "limit violation",
                "share of the steps at which the solver gave no answer to a feasible program",
                _share(Status.SOLVER_FAILED),
            ),
            Metric(
                "not_verified_share", "", "low", 1.0, "limit violation",
                "share of the steps whose answer, claimed solved, failed the recheck",
                _share(Status.NOT_VERIFIED),
            ),
            Metric(
                "claimed_share", "", "high", 0.0, "limit violation",
                "share of the steps with programs of which the solver said that it solved them all",
                lambda m: _share_of(m.trace.claimed == 1, m),
            ),
            Metric(
                "verified_share", "", "high", 0.0, "limit violation",
                "share of the steps with programs whose answers are all right by our own residuals",
                lambda m: _share_of(m.trace.verified == 1, m),
            ),
            Metric(
                "disagreed_share", "", "low", 1.0, "limit violation",
                "share of the steps with programs at which claim and recheck disagree",
                lambda m: _share_of(m.trace.claimed != m.trace.verified, m),
            ),
            Metric(
                "optimum_distance_max_rad_s",
                "rad/s",
                "low",
                _INF,
                "limit violation",
                "largest distance of a solver's answer from the optimum (alpha scaling: in alpha)",
                lambda m: _largest(m.trace.distance),
            ),
            Metric(
                "stuck_share", "", "low", 1.0, "tracking error",
                "share of the steps with something wanted that made less than 1 % of it",
                _stuck_share,
            ),
            Metric(
                "relaxed_share", "", "low", 1.0, "limit violation",
                "share of the steps at which an acceleration bound was given up",
                lambda m: float(np.mean(m.trace.relaxed > 0)) if m.trace.steps else float("nan"),
            ),
            Metric(
                "joint_travel_rad", "rad", "low", _INF, "tracking error",
                "sum of the distances that the joints moved",
                _travel,
            ),
            Metric(
                "sigma_min", "", "high", 0.0, "tracking error",
                "smallest singular value of the task Jacobian (m, rad) on the way",
                lambda m: m.sigma_min,
            ),
        )
    }
)  # fmt: skip
"""Every metric by its name, in the order of the columns."""


def evaluate(motion: Motion) -> dict[str, float]:
    """Every metric of a motion, by name."""
    return {name: metric.of(motion) for name, metric in METRICS.items()}
