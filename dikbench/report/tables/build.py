"""Make the tables of all runs from the rows of trials.csv: each overall and per family."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace
from math import ceil, inf, nan
from typing import Literal

import numpy as np
import pandas as pd

from dikbench.arrays import Array
from dikbench.metrics import METRICS
from dikbench.report.tables.in_force import ACCELERATION, notes_on_limits, with_acceleration_limits
from dikbench.report.tables.kinds import (
    DERIVED,
    LIMIT_VIOLATION,
    MOST,
    Quantity,
    Statistic,
    TableKind,
)
from dikbench.report.tables.table import ALL, Block, Column, Table, TableCell, TableRow
from dikbench.statistics.failures import failures_at_worst, ran
from dikbench.statistics.first_places import BROKEN
from dikbench.statistics.stability import STABLE
from dikbench.statistics.trial_matrix import CONTENDER

SHOWN = 8
"""Columns that are shown where the results have none of those that should be."""

SETTING = ["plant", "reference"]

_READ = (
    *CONTENDER, *SETTING, "scenario", "scenario_family", "status", "outcome",
    "formulation_time_median_us", "timing_stability",
)  # fmt: skip
"""Columns that are read in addition to those that are shown."""

ROUNDING = 1e-9
"""Of the place of a quantile among the runs."""

_Setting = tuple[str | None, str | None]


def make_table(kind: TableKind, trials: pd.DataFrame) -> Table:
    """Make a table, overall and per family; plants and reference modes are never pooled.

    Every run counts, whatever came of it. Trials that were skipped count nowhere; a formulation of
    which all trials were skipped has no row. A table of times has rows where anything was timed.

    Args:
        kind: which table.
        trials: the rows of trials.csv (of times, rows of timing.csv with a status will do).
    """
    chosen = [q for q in kind.quantities if q.of in {*trials.columns, *DERIVED}]
    if not any(q.shown for q in chosen if q.of not in DERIVED):  # older results
        chosen = [replace(q, shown=place < SHOWN) for place, q in enumerate(chosen)]
    if not with_acceleration_limits(trials):
        chosen = [replace(q, shown=q.shown and q.of != ACCELERATION) for q in chosen]
    needed = {*_READ, *(quantity.of for quantity in chosen)}
    rows = _derived(ran(trials[[name for name in trials if name in needed]]))
    if kind.times and not rows["timed"].any():
        rows = rows[:0]
    if not kind.times:  # a failure is never folded into a time
        measured = {q.of for q in chosen} - set(DERIVED)
        rows = rows.assign(**{name: failures_at_worst(rows, name) for name in sorted(measured)})
    columns = tuple(_column(quantity) for quantity in chosen)
    blocks = [
        _block(kind, chosen, name, setting, part)
        for name, of_family in _families(rows)
        for setting, part in _settings(kind, of_family)
    ]
    return Table(
        kind.name,
        kind.title,
        columns,
        tuple(blocks),
        tuple(_notes(kind, trials) if blocks else ()),
        kind.empty,
    )


def _column(quantity: Quantity) -> Column:
    return Column(
        key=quantity.key,
        heading=quantity.heading,
        definition=f"{quantity.statistic.value} of: {quantity.definition}",
        better=_better(quantity),
        count=quantity.statistic is Statistic.NUMBER,
        shown=quantity.shown,
        most=quantity.factor * MOST.get(quantity.of, inf),
    )


def _better(quantity: Quantity) -> Literal["low", "high"] | None:
    """Say which direction of a quantity is better."""
    if quantity.statistic is Statistic.NUMBER:
        return None
    metric = METRICS.get(quantity.of)
    return metric.best if metric else "low"


def _derived(rows: pd.DataFrame) -> pd.DataFrame:
    """Add what is counted as columns of zeros and ones."""
    timed = rows["formulation_time_median_us"].notna()
    outcome = rows["outcome"] if "outcome" in rows else pd.Series("", rows.index)
    derived = {
        "trial": 1.0,
        "stopped": outcome.isin(BROKEN).astype(float).where(outcome.fillna("").ne("")),
        "timed": timed.astype(float),
        "unstable": (timed & (rows["timing_stability"] != STABLE)).astype(float),
    }
    return pd.concat([rows, pd.DataFrame(derived, index=rows.index)], axis=1)


def _families(rows: pd.DataFrame) -> Iterator[tuple[str, pd.DataFrame]]:
    if len(rows):
        yield ALL, rows
        for name, part in rows.groupby("scenario_family", sort=False):
            yield str(name), part


def _settings(kind: TableKind, rows: pd.DataFrame) -> Iterator[tuple[_Setting, pd.DataFrame]]:
    """Yield the rows of each plant and reference mode; of times, all of them."""
    if kind.times:
        yield (None, None), rows
        return
    for (plant, reference), part in rows.groupby(SETTING, sort=False):
        yield (str(plant), str(reference)), part


def _block(
    kind: TableKind,
    quantities: Sequence[Quantity],
    family: str,
    setting: _Setting,
    rows: pd.DataFrame,
) -> Block:
    """Make the rows of a family in a setting, one per formulation and solver."""
    if kind.times:
        rows = rows.drop_duplicates([*CONTENDER, "scenario"])
    columns = [name for name in dict.fromkeys(q.of for q in quantities) if name in rows]
    found = []
    for (formulation, solver), part in rows.groupby(CONTENDER, sort=False):
        unstable = kind.times and 2 * part["unstable"].sum() >= part["timed"].sum() > 0
        values = dict(
            zip(columns, np.sort(part[columns].to_numpy(dtype=float), axis=0).T, strict=True)
        )
        cells = [
            _cell(quantity, values.get(quantity.of), unstable=bool(unstable))
            for quantity in quantities
        ]
        found.append(TableRow(str(formulation), str(solver), tuple(cells)))
    return Block(family, *setting, tuple(found))


def _cell(quantity: Quantity, values: Array | None, *, unstable: bool) -> TableCell:
    number = nan if values is None else quantity.factor * _taken(quantity, values)
    counts = quantity.statistic is Statistic.NUMBER
    return TableCell(number, unstable=unstable and not counts)


def _taken(quantity: Quantity, values: Array) -> float:
    """Compute a number from those of the runs of a row, NaN where none is defined.

    Quantiles are values that occurred, since infinity is among them.

    Args:
        quantity: what is taken.
        values: of the runs, in ascending order, NaN last.
    """
    defined = values[: len(values) - np.count_nonzero(np.isnan(values))]
    if quantity.statistic is Statistic.NUMBER:
        return float(defined.sum())
    if not len(defined):
        return nan
    if quantity.statistic is Statistic.MEAN:
        return float(defined.mean())
    at = {Statistic.MEDIAN: 0.5, Statistic.P95: 0.95, Statistic.WORST: 1.0}[quantity.statistic]
    if _better(quantity) == "high":
        at = 1 - at
    return float(defined[max(ceil(at * len(defined) - ROUNDING) - 1, 0)])


def _notes(kind: TableKind, trials: pd.DataFrame) -> Iterator[str]:
    """Say how the numbers of a table were taken."""
    if kind.times:
        yield (
            "Median and worst are over the scenarios on which the formulation was timed (their "
            f"number stands first), each counting once; the median is {_smallest('half')}. The "
            "median and the 99 % of the calls are those of each scenario's recorded calls."
        )
        yield "Times are marked as not to be trusted where half of the timed cells are unstable."
        return
    yield (
        "Every run counts, whatever came of it; one that broke off takes the worst value that a "
        "metric has, which may be infinite. Formulations are compared in the table of success."
    )
    yield (
        "Median, 95 % and worst are over the runs of a row (their number stands first): all "
        "scenarios and seeds with this plant and reference, those that nothing can do too, each "
        "counting once, not weighed as rates of success are. Where a quantity is not defined in a "
        f"run, the run is left out. Median and 95 % are {_smallest('half, or 95 %,')}."
    )
    yield "Distances from the path and the target count angles with 0.2 m."
    if kind is LIMIT_VIOLATION:
        yield from notes_on_limits(trials)


def _smallest(share: str) -> str:
    """Define the quantile of a share."""
    return f"the smallest value that {share} of them do not exceed, which occurred"
