"""The three tables: tracking error, limit violation, timing."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from types import MappingProxyType

import pandas as pd

from dikbench.selector import parse_selector

LAW = ["formulation", "solver"]
HOW = ["plant", "reference"]
ROUNDING = 1e-9
"""What is smaller than this is rounding, and shown as 0 (the CSV files keep it)."""

ALL = "all"
"""Stands for all families."""


@dataclass(frozen=True)
class Column:
    """A column of a table: a column of the trials, taken over them.

    Attributes:
        of: column of trials.csv.
        how: over the trials of the row: `median`, `max`, `min`, or a function of the values.
        heading: what stands above it.
    """

    of: str
    how: str | Callable[[pd.Series], float]
    heading: str


@dataclass(frozen=True)
class TableKind:
    """One of the tables.

    Attributes:
        title: one line above it.
        columns: what it shows.
    """

    title: str
    columns: Sequence[Column]


def _unstable(verdicts: pd.Series) -> int:
    """Number of cells whose times cannot be trusted."""
    return int((verdicts.notna() & (verdicts != "stable")).sum())


TABLES: Mapping[str, TableKind] = MappingProxyType(
    {
        "tracking_error": TableKind(
            "Tracking error: median over scenarios, and the worst of them",
            (
                Column("position_error_rms_m", "median", "position rms median [m]"),
                Column("position_error_max_m", "max", "position worst [m]"),
                Column("orientation_error_rms_rad", "median", "orientation rms median [rad]"),
                Column("off_course_max_rad", "median", "off course median [rad]"),
                Column("off_course_max_rad", "max", "off course worst [rad]"),
                Column("progress_mean", "median", "progress median"),
                Column("progress_min", "min", "progress worst"),
                Column("stuck_share", "max", "stuck worst share"),
                Column("optimum_distance_max_rad_s", "max", "solver from optimum [rad/s]"),
            ),
        ),
        "limit_violation": TableKind(
            "Limit violation: the worst over scenarios",
            (
                Column("velocity_peak_ratio", "max", "peak speed over limit"),
                Column("position_violation_max_rad", "max", "position [rad]"),
                Column("velocity_violation_max_rad_s", "max", "velocity [rad/s]"),
                Column("acceleration_violation_max_rad_s2", "max", "acceleration [rad/s^2]"),
                Column("violating_share", "max", "violating share"),
                Column("infeasible_share", "max", "infeasible share"),
                Column("solver_failed_share", "max", "solver failed share"),
                Column("not_verified_share", "max", "not verified share"),
            ),
        ),
        "timing": TableKind(
            "Timing of one call of the law: median over scenarios",
            (
                Column("law_time_median_us", "median", "median [us]"),
                Column("law_own_time_median_us", "median", "of it law [us]"),
                Column("solver_core_time_median_us", "median", "solver [us]"),
                Column("solver_wrapper_time_median_us", "median", "wrapper [us]"),
                Column("kinematics_time_median_us", "median", "kinematics beside it [us]"),
                Column("law_time_p99_us", "median", "p99 [us]"),
                Column("law_time_p999_us", "median", "p99.9 [us]"),
                Column("law_time_max_us", "max", "longest [us]"),
                Column("missed_1000_hz_share", "max", "missed at 1 kHz, worst"),
                Column("timing_verdict", _unstable, "unstable"),
            ),
        ),
    }
)


def family(scenario: str) -> str:
    """The family of a scenario's selector."""
    return parse_selector(scenario).name


def make_table(kind: TableKind, trials: pd.DataFrame) -> pd.DataFrame:
    """A table, overall and per family; plants and reference modes are never pooled.

    Rows that were skipped, or failed, count in `trials` and `failed` and carry no numbers.

    Args:
        kind: which table.
        trials: the rows of trials.csv.

    Returns:
        Columns family, plant, reference, formulation, solver, trials, failed, and the table's own
        (of times: family, formulation, solver and the table's own).
    """
    timing = kind is TABLES["timing"]
    keys = ["family", *([] if timing else HOW), *LAW]
    ran = trials[trials["status"] != "skipped"]
    frame = ran.assign(family=ran["scenario"].map(family))
    if timing:
        # Times belong to a law, a solver and a scenario; they stand on the row of each plant.
        frame = frame.drop_duplicates([*LAW, "scenario"])
        frame = frame[frame["law_time_median_us"].notna()]
    if frame.empty:
        headings = [*keys, *(column.heading for column in kind.columns)]
        return pd.DataFrame(columns=headings)
    whole = frame.assign(family=ALL)
    parts = []
    for part in (whole, frame):
        groups = part.groupby(keys, sort=False, dropna=False)
        columns = {
            "trials": groups.size(),
            "failed": groups["status"].agg(lambda s: int((s != "ok").sum())),
        }
        for column in kind.columns:
            columns[column.heading] = groups[column.of].agg(column.how)
        parts.append(pd.DataFrame(columns).reset_index())
    table = pd.concat(parts, ignore_index=True)
    return table.drop(columns=["trials", "failed"]) if timing else table


def to_markdown(kind: TableKind, table: pd.DataFrame) -> str:
    """The table as Markdown, a section per family, four significant digits."""
    lines = [f"# {kind.title}", ""]
    for name, part in table.groupby("family", sort=False):
        shown = part.drop(columns="family")
        lines += [
            f"## {'All families' if name == ALL else str(name)}",
            "",
            markdown_rows(shown),
            "",
        ]
    return "\n".join(lines)


def markdown_rows(table: pd.DataFrame) -> str:
    """A data frame as a Markdown table, its columns aligned for reading as text."""
    numeric = [kind.kind in "if" for kind in table.dtypes]
    rows = [[_cell(value) for value in row] for row in table.itertuples(index=False, name=None)]
    cells = [[str(name) for name in table.columns], *rows]
    widths = [max(3, *(len(row[i]) for row in cells)) for i in range(len(numeric))]

    def line(row: list[str]) -> str:
        padded = (
            text.rjust(width) if right else text.ljust(width)
            for text, width, right in zip(row, widths, numeric, strict=True)
        )
        return "| " + " | ".join(padded) + " |"

    rule = "|".join(
        "-" * (width + 1) + (":" if right else "-")
        for width, right in zip(widths, numeric, strict=True)
    )
    return "\n".join([line(cells[0]), f"|{rule}|", *map(line, rows)])


def _cell(value: object) -> str:
    if isinstance(value, float):
        if value != value:  # NaN
            return ""
        return f"{value:.4g}" if abs(value) >= ROUNDING else "0"
    return f"{value!s}".replace("|", "\\|")
