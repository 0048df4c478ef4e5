"""The leading table: rates of success by situation, where the path may wait and by the clock."""

from __future__ import annotations

from collections.abc import Sequence
from math import nan
from typing import Final

import numpy as np
import pandas as pd

from dikbench.report.selection.judged import (
    CONSTRAINED,
    DEFINITIONS,
    IN_WORDS,
    SETTINGS,
    judged_plant,
    judged_rows,
)
from dikbench.report.sentences.words import several
from dikbench.report.tables.table import ALL, Block, Column, Table, TableCell, TableRow
from dikbench.scenario.situation import Situation
from dikbench.statistics.first_places import (
    FASTER,
    MOST_BROKEN_SHARE,
    SMALLEST_SHARE_OF_BEST,
    dependable,
    first_places,
)
from dikbench.statistics.success import Rates, Setting, rates, succeeded, with_facts

NOT_TOLD: Final = "does not see them"

TITLE: Final = "Success: share of the trials in which the robot did its job [%]"


def success_table(trials: pd.DataFrame) -> Table:
    """Make the table of success by situation, a block per setting.

    Args:
        trials: the rows of trials.csv.
    """
    of_setting = {setting: judged_rows(trials, setting) for setting in SETTINGS}
    found = {setting: rows for setting, rows in of_setting.items() if len(rows)}
    present = {situation for rows in found.values() for situation in rows["situation"]}
    situations = [situation for situation in DEFINITIONS if situation in present]
    columns = (
        *(_column(situation, found) for situation in situations),
        *([_overall("kinematic", found)] if CONSTRAINED in present else []),
        _overall("all", found),
        Column("trials", "trials", "number of trials that count", count=True),
    )
    plant = judged_plant(trials)
    blocks = [
        Block(ALL, plant, setting, _rows(rows, situations, kinematic=CONSTRAINED in present))
        for setting, rows in found.items()
    ]
    return Table("success", TITLE, columns, tuple(blocks), tuple(_notes(trials)))


def _rows(
    rows: pd.DataFrame, situations: Sequence[Situation], *, kinematic: bool
) -> tuple[TableRow, ...]:
    """Make the rows of a setting, one per formulation and solver."""
    candidates, overall = dependable(rows), rates(rows, succeeded(rows))
    names = list(overall.contenders.itertuples(index=False, name=None))
    cells: dict[tuple[str, str], list[TableCell]] = {name: [] for name in names}
    unseen = set(
        rows[rows["sees_constraints"].eq(0)][["formulation", "solver"]].itertuples(
            index=False, name=None
        )
    )
    for situation in situations:
        part = rows[rows["situation"].eq(situation)]
        if part.empty:
            for row in cells.values():
                row.append(TableCell(nan))
            continue
        found = rates(part, succeeded(part))
        first = first_places(part, found, candidates)
        told = {name: situation != CONSTRAINED or name not in unseen for name in names}
        _append(cells, found, first, told)
    if kinematic:
        part = rows[~rows["situation"].eq(CONSTRAINED)]
        _append(cells, rates(part, succeeded(part)), None, {})
    _append(cells, overall, None, {})
    counts = dict(zip(names, overall.trials, strict=True))
    return tuple(
        TableRow(*name, (*row, TableCell(float(counts[name])))) for name, row in cells.items()
    )


def _append(
    cells: dict[tuple[str, str], list[TableCell]],
    found: Rates,
    first: Sequence[bool] | np.ndarray | None,
    told: dict[tuple[str, str], bool],
) -> None:
    """Append a cell per formulation: its rate, and the interval of the difference to the best."""
    of = {
        name: number
        for number, name in enumerate(found.contenders.itertuples(index=False, name=None))
    }
    for name, row in cells.items():
        if name not in of:
            row.append(TableCell(nan))
            continue
        k = of[name]
        row.append(
            TableCell(
                100 * float(found.rate[k]),
                100 * float(found.lower[k]),
                100 * float(found.upper[k]),
                best=first is not None and bool(first[k]),
                text="" if told.get(name, True) else NOT_TOLD,
            )
        )


def _column(situation: Situation, found: dict[Setting, pd.DataFrame]) -> Column:
    parts = {key: rows[rows["situation"].eq(situation)] for key, rows in found.items()}
    return Column(
        key=f"{situation.replace(' ', '_')}_percent",
        heading=situation,
        definition=f"{_sample(parts)}",
        better="high",
        interval=True,
        difference=True,
    )


def _overall(what: str, found: dict[Setting, pd.DataFrame]) -> Column:
    parts = found
    text = "all situations"
    if what == "kinematic":
        parts = {key: rows[~rows["situation"].eq(CONSTRAINED)] for key, rows in found.items()}
        text = "all situations but obstacles and torques"
    return Column(
        key=f"{what}_percent",
        heading=what,
        definition=f"{text}, families weighed equally: {_sample(parts)}",
        better="high",
        interval=True,
        difference=True,
    )


def _sample(parts: dict[Setting, pd.DataFrame]) -> str:
    """Say how many cases the numbers of a column are over."""
    said = []
    for setting, rows in parts.items():
        cases = rows[["scenario", "seed"]].drop_duplicates()
        families, robots = rows["scenario_family"].nunique(), rows["robot"].nunique()
        said.append(
            f"{several(len(cases), 'case')} of {several(cases['scenario'].nunique(), 'scenario')}, "
            f"{families} {'family' if families == 1 else 'families'} and "
            f"{several(robots, 'robot')} where {IN_WORDS[setting]}"
        )
    return "; ".join(said)


def _notes(trials: pd.DataFrame) -> list[str]:
    """Say what counts, what a star says, and what is left out."""
    facts = with_facts(trials)
    cases = facts.drop_duplicates(["scenario", "seed"])
    left_out = cases[~cases["feasible"].isin(["time", "path"])]["feasible"].value_counts()
    notes = [
        "A trial succeeds if every limit is kept, the robot stays within the scenario's tolerance "
        "of its path, does all of it in its order and, by the clock, is not late; where only a "
        "path that waits can be followed, the clock asks that the robot gives way and comes back.",
        "Where the path may wait, the reference waits for the robot; targets at rest are in both.",
        "A rate is a mean over families of means over robots of means over scenarios and seeds; in "
        "brackets the 95 % bootstrap interval of the paired difference to the best, in points.",
        "A star: not told apart from the best here (ties are all starred), not slower than another "
        f"of them by more than {FASTER:g}, successful overall in more than "
        f"{SMALLEST_SHARE_OF_BEST:.0%} of what the best is, and stopped by a limit or a collision "
        f"that it is told of in at most {MOST_BROKEN_SHARE:.0%} of all trials.",
    ]
    if len(left_out):
        said = {"no": "that nothing can do, by proof", "unknown": "of which no motion is known"}
        parts = [f"{count} {said[str(kind)]}" for kind, count in left_out.items() if kind in said]
        if parts:
            notes.append(f"Left out of the rates are cases {' and '.join(parts)}.")
    return notes
