"""What stands in the three tables of every run: tracking error, limit violation, timing."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from enum import Enum
from math import degrees
from types import MappingProxyType
from typing import Final

from dikbench.metrics import METRICS
from dikbench.report.sentences.words import NOT_TIMED
from dikbench.report.tables.in_force import ACCELERATION
from dikbench.results.columns import TIMES
from dikbench.scenario.violation import (
    COLLISION_TOLERANCE_M,
    POSITION_TOLERANCE,
    SPEED_TOLERANCE,
    TORQUE_TOLERANCE,
)

MM: Final = 1e3
DEG: Final = degrees(1.0)
PERCENT: Final = 100.0
MS: Final = 1e-3
"""Factors to the units of tables: millimetres of metres, degrees of radians, percent of shares,
milliseconds of microseconds."""


MOST: Final[Mapping[str, float]] = MappingProxyType(
    {
        "velocity_peak_ratio": SPEED_TOLERANCE,
        "position_violation_max_rad": POSITION_TOLERANCE,
        "distance_violation_max_m": COLLISION_TOLERANCE_M,
        "torque_usage_max": TORQUE_TOLERANCE,
    }
)
"""The largest value of a column of the trials that breaks no limit."""


class Statistic(Enum):
    """How the runs of a row become one number; its value is how notes say it."""

    MEDIAN = "median (half of the runs are at least as good as this)"
    P95 = "95 % of the runs are at least as good as this"
    WORST = "worst run"
    MEAN = "mean"
    NUMBER = "number"


@dataclass(frozen=True)
class Quantity:
    """A column of a table: a column of the trials and what is taken of it.

    Attributes:
        of: column of trials.csv, or of what is derived from it (see `DERIVED`); where it is absent
            (older results), so is the quantity.
        statistic: what is taken over the runs of a row.
        heading: its heading, with the unit in brackets.
        key: its name in CSV.
        factor: from the unit of the column to that of the table.
        shown: whether it is shown, or stands in the CSV alone.
    """

    of: str
    statistic: Statistic
    heading: str
    key: str
    factor: float = 1.0
    shown: bool = True

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
        quantities: its columns, those that are shown first.
        times: whether its numbers are times, which belong to a formulation, a solver and a
            scenario, whatever the plant, reference mode and seed.
        empty: what is said where it has no rows.
    """

    name: str
    title: str
    quantities: Sequence[Quantity]
    times: bool = False
    empty: str = "Nothing was measured."


DERIVED: Final[Mapping[str, str]] = MappingProxyType(
    {
        "trial": "1 for a trial that was not skipped",
        "stopped": "1 for a trial that broke a limit, collided or broke off, else 0",
        "timed": "1 for a scenario on which the formulation was timed",
        "unstable": "1 for a scenario on which its times cannot be trusted",
    }
)
"""Columns that are derived from the rows of trials, to be counted."""

RUNS: Final = Quantity("trial", Statistic.NUMBER, "runs", "runs")

_NAMES: Final = {Statistic.MEDIAN: "median", Statistic.P95: "95 %", Statistic.WORST: "worst"}
_KEYS: Final = {Statistic.MEDIAN: "median", Statistic.P95: "p95", Statistic.WORST: "worst"}


def _spread(
    of: str,
    what: str,
    unit: str,
    factor: float,
    *statistics: Statistic,
    key: str = "",
    shown: bool = True,
) -> list[Quantity]:
    """Make a column per statistic; default: median, 95 % and worst."""
    in_brackets = f" [{unit}]" if unit else ""
    suffix = {"mm": "_mm", "deg": "_deg", "%": "_percent", "ms": "_ms"}.get(unit, "")
    return [
        Quantity(
            of,
            statistic,
            f"{what} {_NAMES[statistic]}{in_brackets}",
            f"{key or what.replace(' ', '_')}_{_KEYS[statistic]}{suffix}",
            factor,
            shown,
        )
        for statistic in statistics or tuple(_NAMES)
    ]


def _more(of: str, what: str, unit: str = "", factor: float = 1.0) -> list[Quantity]:
    """Make the three columns of a quantity that stands in the CSV alone."""
    return _spread(of, what, unit, factor, shown=False)


_WORST: Final = Statistic.WORST

TRACKING_ERROR: Final = TableKind(
    "tracking_error",
    "Tracking error: the largest in a run, over all runs",
    (
        RUNS,
        *_spread("contour_error_6d_max_m", "off the path", "mm", MM),
        *_spread("tracking_error_6d_max_m", "off the target", "mm", MM),
        *_spread("path_done_share", "path done", "%", PERCENT, _WORST),
        *_more("position_error_max_m", "position error", "mm", MM),
        *_more("position_error_rms_m", "position error rms", "mm", MM),
        *_more("orientation_error_max_rad", "orientation error", "deg", DEG),
        *_more("orientation_error_rms_rad", "orientation error rms", "deg", DEG),
        *_more("contour_error_max_m", "contour error of the position", "mm", MM),
        *_more("direction_error_max_rad", "direction error", "deg", DEG),
        *_more("course_rad", "course", "deg", DEG),
        *_more("lag_max_s", "lag s"),
        *_more("slow_down", "slow down"),
        *_more("progress_mean", "progress", "%", PERCENT),
        *_more("stuck_share", "stuck", "%", PERCENT),
    ),
)

LIMIT_VIOLATION: Final = TableKind(
    "limit_violation",
    "Limit violation: the largest in a run, over all runs",
    (
        RUNS,
        Quantity("stopped", Statistic.MEAN, "runs stopped [%]", "stopped_percent", PERCENT),
        *_spread("velocity_peak_ratio", "speed over limit", "", 1.0),
        *_spread("position_violation_max_rad", "position outside", "deg", DEG, _WORST),
        *_spread("distance_violation_max_m", "distance missing", "mm", MM, _WORST),
        *_spread("torque_usage_max", "torque over limit", "", 1.0, _WORST),
        Quantity(ACCELERATION, Statistic.WORST, "acceleration above limit worst [rad/s2]",
                 "acceleration_above_limit_rad_s2_worst"),
        *_spread(ACCELERATION, "acceleration above limit rad s2", "", 1.0,
                 Statistic.MEDIAN, Statistic.P95, shown=False),
        *_more("velocity_violation_max_rad_s", "speed above limit rad s"),
        *_more("violating_share", "steps that violate", "%", PERCENT),
        *_more("torque_violating_share", "steps with too much torque", "%", PERCENT),
        *_more("chatter_share", "steps that chatter", "%", PERCENT),
        *_more("infeasible_share", "infeasible steps", "%", PERCENT),
        *_more("solver_failed_share", "steps without an answer", "%", PERCENT),
        *_more("not_verified_share", "steps not verified", "%", PERCENT),
        *_more("optimum_distance_max_rad_s", "from the optimum rad s"),
    ),
)  # fmt: skip

TIMING: Final = TableKind(
    "timing",
    "Timing of one call of the formulation, over the scenarios on which it was timed",
    (
        Quantity("timed", Statistic.NUMBER, "scenarios", "scenarios"),
        *_spread("formulation_time_median_us", "median call", "ms", MS, Statistic.MEDIAN),
        *_spread("formulation_time_median_us", "median call", "ms", MS, _WORST),
        *_spread("formulation_time_p99_us", "99 % of the calls", "ms", MS, Statistic.MEDIAN,
                 key="p99_call"),
        *_spread("formulation_time_max_us", "longest call", "ms", MS, _WORST),
        *_spread("solver_core_time_median_us", "of it solver", "ms", MS, Statistic.MEDIAN),
        *_spread("missed_1000_hz_share", "missed at 1 kHz", "%", PERCENT, _WORST),
        Quantity("unstable", Statistic.NUMBER, "unstable", "unstable"),
        *_more("formulation_own_time_median_us", "of it formulation", "ms", MS),
        *_more("solver_wrapper_time_median_us", "of it wrapper", "ms", MS),
        *_more("formulation_time_p999_us", "99.9 % of the calls", "ms", MS),
        *_more("kinematics_time_median_us", "kinematics in addition", "ms", MS),
        *_more("missed_100_hz_share", "missed at 100 Hz", "%", PERCENT),
        *_more("missed_200_hz_share", "missed at 200 Hz", "%", PERCENT),
        *_more("missed_500_hz_share", "missed at 500 Hz", "%", PERCENT),
    ),
    times=True,
    empty=NOT_TIMED,
)  # fmt: skip

KINDS: Final = (TRACKING_ERROR, LIMIT_VIOLATION, TIMING)
