"""What stands in the three tables: tracking error, limit violation, timing."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from enum import Enum
from types import MappingProxyType

from dikbench.metrics import METRICS
from dikbench.results.columns import TIMES


class Statistic(Enum):
    """How the trials of a row become one number; its value is how notes say it."""

    GEOMETRIC_MEAN = "shifted geometric mean"
    MEAN = "mean"
    WORST = "worst"
    NUMBER = "number"


@dataclass(frozen=True)
class Quantity:
    """A column of a table: a column of the trials and what is taken of it.

    Attributes:
        of: column of trials.csv, or of what is derived from it (see `tables.build`);
            where it is absent (older results), so is the quantity.
        statistic: what is taken over the trials of a row.
        heading: what stands above it.
        key: its name in CSV.
        compared: whether the best formulation is marked.
    """

    of: str
    statistic: Statistic
    heading: str
    key: str
    compared: bool = True

    @property
    def definition(self) -> str:
        """What the column of the trials holds, in a line."""
        if self.of in METRICS:
            return METRICS[self.of].definition
        if self.of in TIMES:
            return TIMES[self.of][1]
        return DERIVED.get(self.of, self.of)


@dataclass(frozen=True)
class TableKind:
    """One of the tables.

    Attributes:
        name: of its files.
        title: one line above it.
        quantities: what it shows after the failures, the most telling first.
        times: whether its numbers are times, which belong to a formulation, a solver and a
            scenario, whatever the plant, reference mode and seed.
    """

    name: str
    title: str
    quantities: Sequence[Quantity]
    times: bool = False


DERIVED: Mapping[str, str] = MappingProxyType(
    {
        "trial": "1 for a trial that was not skipped",
        "failed": "1 for a trial that broke off (diverged, crashed, timed out ...), else 0",
        "timed": "1 for a scenario on which the formulation was timed",
        "unstable": "1 for a scenario on which its times cannot be trusted",
    }
)
"""Columns that are derived from the rows of trials, to be counted."""

FAILURES = (
    Quantity("failed", Statistic.MEAN, "failure rate", "failure_rate"),
    Quantity("failed", Statistic.NUMBER, "failed", "failed", compared=False),
    Quantity("trial", Statistic.NUMBER, "trials", "trials", compared=False),
)
"""The first columns of every table."""

CELLS = (
    Quantity("timed", Statistic.NUMBER, "cells timed", "timed", compared=False),
    Quantity("unstable", Statistic.NUMBER, "unstable", "unstable", compared=False),
)
"""What follows them where times are shown."""


def _average(of: str, heading: str) -> Quantity:
    """Of what spans orders of magnitude."""
    return Quantity(of, Statistic.GEOMETRIC_MEAN, heading, of)


def _mean(of: str, heading: str) -> Quantity:
    """Of shares."""
    return Quantity(of, Statistic.MEAN, heading, of)


def _worst(of: str, heading: str) -> Quantity:
    return Quantity(of, Statistic.WORST, heading, f"{of}_worst")


def _part(of: str, heading: str) -> Quantity:
    """Of a time: a part of it, in which nobody wins."""
    return Quantity(of, Statistic.GEOMETRIC_MEAN, heading, of, compared=False)


TRACKING_ERROR = TableKind(
    "tracking_error",
    "Tracking error: averages over trials, and the worst of them",
    (
        _average("contour_error_rms_m", "contour rms [m]"),
        _worst("contour_error_max_m", "contour worst [m]"),
        _worst("lag_max_s", "lag worst [s]"),
        _worst("path_done_share", "path done worst"),
        _average("position_error_rms_m", "position rms [m]"),
        _worst("position_error_max_m", "position worst [m]"),
        _average("orientation_error_rms_rad", "orientation rms [rad]"),
        _average("direction_error_max_rad", "direction error [rad]"),
        _worst("direction_error_max_rad", "direction error worst [rad]"),
        _mean("progress_mean", "progress"),
        _worst("progress_min", "progress worst"),
        _mean("stuck_share", "stuck share"),
        _worst("stuck_share", "stuck share worst"),
        _worst("optimum_distance_max_rad_s", "solver from optimum worst [rad/s]"),
    ),
)

LIMIT_VIOLATION = TableKind(
    "limit_violation",
    "Limit violation: averages over trials, and the worst of them",
    (
        _mean("violating_share", "violating share"),
        _average("velocity_peak_ratio", "peak speed over limit"),
        _worst("velocity_peak_ratio", "peak speed over limit worst"),
        _worst("position_violation_max_rad", "position worst [rad]"),
        _worst("velocity_violation_max_rad_s", "velocity worst [rad/s]"),
        _worst("acceleration_violation_max_rad_s2", "acceleration worst [rad/s^2]"),
        _worst("distance_violation_max_m", "distance below margin worst [m]"),
        _worst("torque_usage_max", "torque over limit worst"),
        _mean("torque_violating_share", "torque violating share"),
        _worst("position_violation_integral_rad_s", "position integral worst [rad*s]"),
        _worst("velocity_violation_integral_rad", "velocity integral worst [rad]"),
        _worst("acceleration_violation_integral_rad_s", "acceleration integral worst [rad/s]"),
        _worst("violating_share", "violating share worst"),
        _worst("infeasible_share", "infeasible share worst"),
        _worst("solver_failed_share", "solver failed share worst"),
        _worst("not_verified_share", "not verified share worst"),
    ),
)

TIMING = TableKind(
    "timing",
    "Timing of one call of the formulation: averages over scenarios, and the worst of them",
    (
        *CELLS,
        _average("formulation_time_median_us", "median [us]"),
        _part("formulation_own_time_median_us", "of it formulation [us]"),
        _part("solver_core_time_median_us", "solver [us]"),
        _part("solver_wrapper_time_median_us", "wrapper [us]"),
        _average("formulation_time_p99_us", "p99 [us]"),
        _part("formulation_time_p999_us", "p99.9 [us]"),
        _worst("formulation_time_max_us", "longest [us]"),
        _worst("missed_1000_hz_share", "missed at 1 kHz worst"),
        _part("kinematics_time_median_us", "kinematics beside it [us]"),
    ),
    times=True,
)

KINDS = (TRACKING_ERROR, LIMIT_VIOLATION, TIMING)


def kinds_with(column: str) -> list[TableKind]:
    """Return the tables in which a column of the trials stands."""
    return [kind for kind in KINDS if any(each.of == column for each in kind.quantities)]
