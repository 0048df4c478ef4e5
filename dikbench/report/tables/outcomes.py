"""The table of outcomes: what became of the trials, and what other tolerances would say."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from dataclasses import replace
from math import nan
from typing import Any, Final

import numpy as np
import pandas as pd

from dikbench.arrays import Mask
from dikbench.metrics import OUTCOME_SENTENCES, Judgement, Outcome
from dikbench.report.selection.judged import SETTINGS, judged_plant, judged_rows
from dikbench.report.tables.success import NO_OUTCOMES
from dikbench.report.tables.table import ALL, Block, Column, Table, TableCell, TableRow
from dikbench.statistics.failures import ran
from dikbench.statistics.success import DONE, rates, succeeded, succeeded_at, with_facts
from dikbench.statistics.trial_matrix import CONTENDER

TITLE: Final = "Outcomes: what became of the trials that count, in numbers"

TIGHT_M: Final = 2e-3
LOOSE_M: Final = 2e-2
"""Tolerances at which success is told in addition to the scenario's own [m]."""

SPEED_SHARE: Final = 1.05
"""Share of the speed limit up to which a trial is forgiven in one of the columns."""

_RATES: Final = (
    Column("success_percent", "success [%]", "rate of success", "high", whole=True),
    Column(
        "without_chatter_percent",
        "chatter forgiven [%]",
        "rate of success where chattering is forgiven",
        "high",
        short="chatter forgiven",
        whole=True,
    ),
    Column(
        "at_2_mm_percent",
        "at 2 mm [%]",
        "rate of success if every scenario's tolerance were 2 mm",
        "high",
        short="at 2 mm",
        whole=True,
    ),
    Column(
        "at_20_mm_percent",
        "at 20 mm [%]",
        "rate of success if every scenario's tolerance were 20 mm",
        "high",
        short="at 20 mm",
        whole=True,
    ),
    Column(
        "at_105_percent_speed_percent",
        "at 1.05 of the speed limit [%]",
        "rate of success where joint speeds up to 1.05 of their limit are forgiven, if no "
        "acceleration, position, torque or distance is beyond its limit in addition",
        "high",
        short="at 1.05 speed",
        whole=True,
    ),
    Column(
        "coped_percent",
        "coped [%]",
        "share of the trials in which nothing can follow, by proof, that kept all limits, did the "
        "path as far as can be done and came back where it comes back",
        "high",
        short="coped",
        whole=True,
    ),
)


def outcome_table(trials: pd.DataFrame) -> Table:
    """Make the table of outcomes, a block per setting.

    Args:
        trials: the rows of trials.csv.
    """
    plant = judged_plant(trials)
    found = {setting: judged_rows(trials, setting) for setting in SETTINGS}
    seen = {outcome for rows in found.values() for outcome in rows["outcome"]}
    counts = [
        Column(
            outcome.value.replace("-", "_"),
            outcome.value,
            f"number of trials: {OUTCOME_SENTENCES[outcome]}",
            count=True,
            shown=outcome.value in seen,
        )
        for outcome in Outcome
    ]
    columns = (Column("trials", "trials", "number of trials that count", count=True), *counts)
    blocks = [
        Block(ALL, plant, setting, _rows(rows, _unfollowable(trials, setting)))
        for setting, rows in found.items()
        if len(rows)
    ]
    notes = (
        "Each trial has one outcome, the first in this order that applies; rates are means as in "
        "the table of success; `coped` is a plain share of the trials, none of which counts above.",
    )
    return Table("outcomes", TITLE, (*columns, *_RATES), tuple(blocks), notes, NO_OUTCOMES)


def _unfollowable(trials: pd.DataFrame, setting: str) -> pd.Series:
    """Return the share of the trials that coped where nothing can follow, per formulation."""
    rows = ran(with_facts(trials))
    rows = rows[rows["plant"].eq(judged_plant(trials)) & rows["reference"].eq(setting)]
    asked = rows[rows["feasible"].eq("no")]
    return asked.groupby(CONTENDER, sort=False)["coped"].mean()


def _rows(rows: pd.DataFrame, coped: pd.Series) -> tuple[TableRow, ...]:
    done = succeeded(rows)
    chatters = rows["outcome"].eq(Outcome.CHATTERING.value).to_numpy()
    within = done | _too_fast_alone(rows)
    found = [
        rates(rows, kind)
        for kind in (
            done, done | chatters, succeeded_at(rows, TIGHT_M), succeeded_at(rows, LOOSE_M), within,
        )
    ]  # fmt: skip
    made = []
    for k, (name, solver) in enumerate(found[0].contenders.itertuples(index=False, name=None)):
        own = rows[rows["formulation"].eq(name) & rows["solver"].eq(solver)]
        counts = Counter(own["outcome"])
        numbers: Sequence[float] = (
            len(own),
            *(counts[outcome.value] for outcome in Outcome),
            *(100 * float(each.rate[k]) for each in found),
            100 * float(coped.get((name, solver), nan)),
        )
        made.append(TableRow(name, solver, tuple(TableCell(float(x)) for x in numbers)))
    return tuple(made)


def _too_fast_alone(rows: pd.DataFrame) -> Mask:
    """Say which trials would have succeeded but for joint speeds up to `SPEED_SHARE`.

    Nothing is forgiven where an acceleration, a position, a torque or a distance is beyond its
    limit, by however little, so that this is never too many.
    """
    only = rows["decided_before"].eq(Outcome.LIMIT_BROKEN.value) & rows["status"].eq("ok")
    only &= rows["velocity_peak_ratio"].le(SPEED_SHARE)
    for column in (
        "acceleration_violation_max_rad_s2",
        "position_violation_max_rad",
        "distance_violation_max_m",
    ):
        only &= ~rows[column].gt(0.0)
    only &= ~rows["torque_usage_max"].gt(1.0)
    forgiven: Mask = only.to_numpy(dtype=bool, copy=True)
    records: list[Any] = rows[forgiven].to_dict("records")
    forgiven[np.flatnonzero(forgiven)] = [
        replace(Judgement.of_row(row), before=None).at(row["tolerance_m"]).outcome.value in DONE
        for row in records
    ]
    return forgiven
