"""The leading table: rates of success by situation, where the path may wait and by the clock."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from math import nan
from types import MappingProxyType
from typing import Final

import numpy as np
import pandas as pd

from dikbench.arrays import Mask
from dikbench.report.selection.judged import (
    CONSTRAINED,
    DEFINITIONS,
    IN_WORDS,
    SETTINGS,
    judged_plant,
    judged_rows,
    rows_of_all,
)
from dikbench.report.sentences.sample import cases_in_words, scenarios_in_words
from dikbench.report.sentences.words import several
from dikbench.report.tables.table import (
    ALL,
    NOT_TOLD,
    Block,
    Column,
    Table,
    TableCell,
    TableRow,
)
from dikbench.scenario.situation import Situation
from dikbench.statistics.first_places import (
    FASTER,
    FEWEST_SCENARIOS,
    MOST_BROKEN_SHARE,
    SMALLEST_SHARE_OF_BEST,
    dependable,
    first_places,
    told_of,
    too_few,
)
from dikbench.statistics.success import (
    MOST_BEHIND,
    Contender,
    Rates,
    Setting,
    rates,
    succeeded,
    with_facts,
)

SHORT: Final[Mapping[Situation, str]] = MappingProxyType(
    {
        "near singularities": "near sing.",
        "at joint limits": "joint limits",
        "beyond joint speed": "joint speed",
        CONSTRAINED: "obst., torque",
    }
)
"""Situations in short headings, where they are shorter."""

NO_OUTCOMES: Final = "Nothing can be said of success: no trial has an outcome that counts."

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
    plant, every = judged_plant(trials), rows_of_all(of_setting)
    blocks = [
        Block(ALL, plant, setting, _rows(rows, candidates, situations), _sizes(rows, situations))
        for setting, rows, candidates in (
            (setting, rows, dependable(rows, every)) for setting, rows in found.items()
        )
    ]
    return Table("success", TITLE, columns, tuple(blocks), tuple(_notes(trials)), NO_OUTCOMES)


def _sizes(rows: pd.DataFrame, situations: Sequence[Situation]) -> str:
    """Say of a setting which columns are of too few scenarios for a star, and of what each is."""
    parts = {situation: rows[rows["situation"].eq(situation)] for situation in situations}
    few = [
        f"{situation} ({several(part['scenario'].nunique(), 'scenario')})"
        for situation, part in parts.items()
        if len(part) and too_few(part)
    ]
    said = [f"{name}: {scenarios_in_words(part)}" for name, part in parts.items() if len(part)]
    return (f"Too few cases for stars: {', '.join(few)}. " if few else "") + (
        f"Samples: {'. '.join(said)}."
    )


def _rows(
    rows: pd.DataFrame, candidates: set[Contender], situations: Sequence[Situation]
) -> tuple[TableRow, ...]:
    """Make the rows of a setting, one per formulation and solver."""
    overall = rates(rows, succeeded(rows), candidates)
    names: list[Contender] = list(overall.contenders.itertuples(index=False, name=None))
    cells: dict[Contender, list[TableCell]] = {name: [] for name in names}
    told = told_of(rows, names)
    for situation in situations:
        part = rows[rows["situation"].eq(situation)]
        if part.empty:
            for row in cells.values():
                row.append(TableCell(nan))
            continue
        found = rates(part, succeeded(part), told_of(part, candidates))
        untold = () if situation != CONSTRAINED else [name for name in names if name not in told]
        _append(cells, found, first_places(part, found), untold)
    nobody = np.zeros(len(names), dtype=bool)
    if CONSTRAINED in situations:
        part = rows[~rows["situation"].eq(CONSTRAINED)]
        _append(cells, rates(part, succeeded(part), candidates), nobody)
    _append(cells, overall, nobody)
    counts = dict(zip(names, overall.trials, strict=True))
    return tuple(
        TableRow(*name, (*row, TableCell(float(counts[name])))) for name, row in cells.items()
    )


def _append(
    cells: dict[Contender, list[TableCell]],
    found: Rates,
    first: Mask,
    untold: Sequence[Contender] = (),
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
                best=bool(first[k]),
                text=NOT_TOLD if name in untold else "",
            )
        )


def _column(situation: Situation, found: dict[Setting, pd.DataFrame]) -> Column:
    parts = {key: rows[rows["situation"].eq(situation)] for key, rows in found.items()}
    return Column(
        key=f"{situation.replace(' ', '_')}_percent",
        heading=situation,
        definition=_sample(parts),
        better="high",
        interval=True,
        short=SHORT.get(situation, ""),
        whole=True,
    )


def _overall(what: str, found: dict[Setting, pd.DataFrame]) -> Column:
    parts, text = found, "all situations"
    if what == "kinematic":
        parts = {key: rows[~rows["situation"].eq(CONSTRAINED)] for key, rows in found.items()}
        text = "all situations but obstacles and torques"
    return Column(
        key=f"{what}_percent",
        heading=what,
        definition=f"{text}, families weighed equally: {_sample(parts)}",
        better="high",
        interval=True,
        short="kinem." if what == "kinematic" else "",
        whole=True,
    )


def _sample(parts: dict[Setting, pd.DataFrame]) -> str:
    """Say how many cases the numbers of a column are over."""
    said = []
    for setting, rows in parts.items():
        if rows.empty:
            continue
        families = rows["scenario_family"].nunique()
        said.append(
            f"{cases_in_words(rows)} of {families} {'family' if families == 1 else 'families'} "
            f"where {IN_WORDS[setting]}"
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
        "A rate is a mean over families of means over robots of means over scenarios and seeds, so "
        "that one scenario of one robot may weigh as much as several of another (see the samples).",
        "Who may be starred is stopped by a limit that it is told of, a collision or a failure in "
        f"at most {100 * MOST_BROKEN_SHARE:g} % of all trials, and successful overall in more than "
        f"{100 * SMALLEST_SHARE_OF_BEST:g} % of what the best of those is. A star: not told apart "
        f"from the best of those here and at most {100 * MOST_BEHIND:g} points behind it (ties are "
        "all starred), and not slower than another of them by a ratio of more than "
        f"{FASTER:g}. Where fewer than {FEWEST_SCENARIOS} scenarios count nobody is starred. "
        "Without a star one is worse, or slower, only where the interval is below 0: where it "
        "holds 0 the trials do not tell the two apart.",
        "In brackets stands the 95 % interval of the difference to the best of those that may be "
        "starred, in points, from a bootstrap over families, robots, scenarios and seeds, trials "
        "paired; none where it has no width.",
    ]
    if len(left_out):
        said = {"no": "cases that nothing can do", "unknown": "of which no motion is known"}
        parts = [f"{count} {said[str(kind)]}" for kind, count in left_out.items() if kind in said]
        if parts:
            notes.append(f"Left out of the rates are {' and '.join(parts)}.")
    return notes
