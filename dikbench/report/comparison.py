"""Which laws lead in a metric, and which of them the trials do not tell apart."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

import pandas as pd

from dikbench.report.words import Law

SAME: Final = 0.01
"""Values closer together than this share of the smaller one are the same."""

ROUNDING: Final = 1e-9
"""Differences smaller than this are rounding."""


@dataclass(frozen=True)
class Lead:
    """The law with the smallest median of a metric, and those that cannot be told apart from it.

    Attributes:
        laws: all of them, the one with the smallest median first.
        value: the smallest median.
        runner_up: the next law that can be told apart; None where there is none.
        runner_up_value: its median.
        wins: in how many of the trials that both ran the leader was better than it.
        trials: how many trials each law ran.
    """

    laws: tuple[Law, ...]
    value: float
    runner_up: Law | None
    runner_up_value: float
    wins: int
    trials: int


def table_of(rows: pd.DataFrame, metric: str, laws: Sequence[Law]) -> pd.DataFrame:
    """A metric with a row per scenario and seed and a column per law, (cells, laws)."""
    values = rows.set_index(["scenario", "seed", "formulation", "solver"])[metric]
    table = values[~values.index.duplicated()].unstack(["formulation", "solver"])
    return table.reindex(columns=pd.MultiIndex.from_tuples(laws)).dropna(how="all")


def lead(rows: pd.DataFrame, metric: str, laws: Sequence[Law]) -> Lead | None:
    """Who leads in a metric of which the smallest value is the best.

    Another law is told apart from the leader only where its median is larger by more than 1 %, and
    the leader is better by more than that in more than half of the trials that both ran.

    Args:
        rows: trials of one plant and one reference mode.
        metric: its column.
        laws: those that are compared; all ran all trials.

    Returns:
        None where the metric is defined for none of them.
    """
    table = table_of(rows, metric, laws) if laws else pd.DataFrame()
    table = table.dropna(axis="columns")
    if table.empty:
        return None
    medians = table.median().sort_values(kind="stable")
    best = medians.index[0]
    together, apart = [best], []
    for law in medians.index[1:]:
        wins = int(_smaller(table[best], table[law]).sum())
        told = medians[law] - medians[best] > SAME * medians[best] + ROUNDING
        if told and 2 * wins > len(table):
            apart.append((law, wins))
        else:
            together.append(law)
    runner_up, wins = apart[0] if apart else (None, 0)
    return Lead(
        tuple(together),
        float(medians[best]),
        runner_up,
        float(medians[runner_up]) if runner_up else float("nan"),
        wins,
        len(table),
    )


def _smaller(one: pd.Series, other: pd.Series) -> pd.Series:
    return (other - one) > SAME * one.abs() + ROUNDING
