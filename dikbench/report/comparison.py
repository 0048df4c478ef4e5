"""Which laws lead in a metric, and which of them the trials do not tell apart."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

import pandas as pd

from dikbench.report.words import Law

SAME: Final = 0.01
"""Values closer together than this share of the smaller one are the same."""

MOST: Final = 2 / 3
"""A law is better than another where it wins this share of the trials that one of them wins."""

ROUNDING: Final = 1e-9
"""Differences smaller than this are rounding."""


@dataclass(frozen=True)
class Lead:
    """The law with the smallest median of a metric, and those that cannot be told apart from it.

    Attributes:
        laws: all of them, in the order in which they ran.
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
    where the leader wins at least two thirds of the trials in which they differ by more than that.

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
    together: list[Law] = [best]
    apart: dict[Law, int] = {}
    for law in medians.index[1:]:
        wins = int(_smaller(table[best], table[law]).sum())
        told = medians[law] - medians[best] > SAME * abs(medians[best]) + ROUNDING
        losses = int(_smaller(table[law], table[best]).sum())
        if told and wins >= MOST * (wins + losses):
            apart[law] = wins
        else:
            together.append(law)
    place = {law: number for number, law in enumerate(laws)}
    together.sort(key=place.__getitem__)
    value = float(medians[best])
    if not apart:
        return Lead(tuple(together), value, None, float("nan"), 0, len(table))
    second = min(medians[law] for law in apart)
    alike = [law for law in apart if medians[law] <= second + SAME * abs(second)]
    runner_up = min(alike, key=place.__getitem__)
    return Lead(
        tuple(together), value, runner_up, float(medians[runner_up]), apart[runner_up], len(table)
    )


def _smaller(one: pd.Series, other: pd.Series) -> pd.Series:
    return (other - one) > SAME * one.abs() + ROUNDING
