"""Make the tables from the rows of trials.csv: each overall and per family."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np
import pandas as pd

from dikbench.arrays import Mask
from dikbench.report.tables.kinds import DERIVED, FAILURES, Quantity, TableKind
from dikbench.report.tables.sample import SMALLEST_DIFFERENCE, Sample, describe
from dikbench.report.tables.table import ALL, DIGITS, Block, Column, Table, TableRow
from dikbench.statistics.failures import failures_at_worst, has_failed, ran
from dikbench.statistics.stability import STABLE
from dikbench.statistics.trial_matrix import CONTENDER

HOW = ["plant", "reference"]

_Setting = tuple[str | None, str | None]


def make_table(kind: TableKind, trials: pd.DataFrame) -> Table:
    """A table, overall and per family; plants and reference modes are never pooled.

    Trials that were skipped count nowhere; a formulation of which all trials were skipped has no
    row.

    Args:
        kind: which table.
        trials: the rows of trials.csv (of times, rows of timing.csv with a status will do).
    """
    chosen = [q for q in (*FAILURES, *kind.quantities) if q.of in {*trials.columns, *DERIVED}]
    rows = _derived(ran(trials))
    if not kind.times:  # a failure is never folded into a time
        measured = {q.of for q in chosen} - set(DERIVED)
        rows = rows.assign(**{name: failures_at_worst(rows, name) for name in sorted(measured)})
    columns = tuple(describe(quantity, rows) for quantity in chosen)
    blocks = [
        _block(kind, chosen, columns, name, how, part)
        for name, of_family in _families(rows)
        for how, part in _settings(kind, of_family)
    ]
    return Table(kind.name, kind.title, columns, tuple(blocks), tuple(_notes(kind, columns)))


def _derived(rows: pd.DataFrame) -> pd.DataFrame:
    """Add what is counted as columns of zeros and ones."""
    timed = rows["formulation_time_median_us"].notna()
    return rows.assign(
        trial=1.0,
        failed=has_failed(rows).astype(float),
        timed=timed.astype(float),
        unstable=(timed & (rows["timing_stability"] != STABLE)).astype(float),
    )


def _families(rows: pd.DataFrame) -> Iterator[tuple[str, pd.DataFrame]]:
    if len(rows):
        yield ALL, rows
        for name, part in rows.groupby("scenario_family", sort=False):
            yield str(name), part


def _settings(kind: TableKind, rows: pd.DataFrame) -> Iterator[tuple[_Setting, pd.DataFrame]]:
    """The rows of each plant and reference mode; of times, all of them."""
    if kind.times:
        yield (None, None), rows
        return
    for (plant, reference), part in rows.groupby(HOW, sort=False):
        yield (str(plant), str(reference)), part


def _block(
    kind: TableKind,
    quantities: Sequence[Quantity],
    columns: Sequence[Column],
    family: str,
    how: _Setting,
    rows: pd.DataFrame,
) -> Block:
    contenders = rows[CONTENDER].drop_duplicates()
    trials = Sample.of(rows, np.zeros(len(contenders), dtype=bool))
    measured = trials
    if kind.times:
        one_each = rows.drop_duplicates([*CONTENDER, "scenario"])
        cells = one_each[[name for name in rows if name not in (*HOW, "seed")]]
        cells = cells.assign(failed=0.0)  # a time was taken whatever became of the trial
        measured = Sample.of(cells, _unstable(cells))
    grid = [
        (trials if quantity in FAILURES else measured).cells(quantity, column)
        for quantity, column in zip(quantities, columns, strict=True)
    ]
    found = [
        TableRow(str(formulation), str(solver), tuple(cells))
        for formulation, solver, *cells in zip(
            contenders["formulation"], contenders["solver"], *grid, strict=True
        )
    ]
    plant, reference = how
    return Block(family, plant, reference, tuple(found))


def _unstable(cells: pd.DataFrame) -> Mask:
    """Whether at least half of the timed cells of each formulation are unstable."""
    sums = cells.groupby(CONTENDER, sort=False)[["timed", "unstable"]].sum()
    unstable: Mask = (sums["timed"].gt(0) & (2 * sums["unstable"] >= sums["timed"])).to_numpy()
    return unstable


def _notes(kind: TableKind, columns: Sequence[Column]) -> Iterator[str]:
    """How the numbers of a table were taken."""
    for column in columns:
        yield f"{column.heading}: {column.definition}."
    if kind.times:
        yield "Times are marked as not to be trusted where half of the timed cells are unstable."
    else:
        yield (
            "A failed trial takes the worst value that a metric has; where that is infinite it "
            "stands in the failures and in the worst, and averages leave it out."
        )
    yield (
        "Intervals are 95 % bootstrap intervals over families, scenarios and seeds; there is none "
        "where all trials agree."
    )
    yield (
        f"The best law is marked where laws differ in {DIGITS} digits and by more than "
        f"{SMALLEST_DIFFERENCE:g}, among those that have a number of every trial that any law came "
        "through; the oracle is not compared."
    )
