"""Which formulations lead in a metric, and which of them the trials do not tell apart."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np
import pandas as pd

from dikbench.report.sentences.words import Contender
from dikbench.statistics.trial_matrix import CONTENDER

SAME: Final = 0.01
"""Values closer together than this share of the smaller one are the same."""

MOST: Final = 2 / 3
"""A formulation is better than another where it wins this share of the trials that one of them
wins."""

ROUNDING: Final = 1e-9
"""Differences smaller than this are rounding."""


@dataclass(frozen=True)
class Lead:
    """The law with the smallest median of a metric, and those that cannot be told apart from it.

    Attributes:
        formulations: all of them, in the order in which they ran.
        value: the smallest median.
        runner_up: the next formulation that can be told apart; None where there is none.
        runner_up_value: its median.
        wins: in how many of the trials that both ran the leader was better than it.
        trials: how many trials each formulation ran.
    """

    contenders: tuple[Contender, ...]
    value: float
    runner_up: Contender | None
    runner_up_value: float
    wins: int
    trials: int


def lead(rows: pd.DataFrame, metric: str, contenders: Sequence[Contender]) -> Lead | None:
    """Who leads in a metric of which the smallest value is the best.

    Another one is distinguished from the leader only where its median is larger by more than 1 %,
    and where the leader wins at least two thirds of the trials in which they differ by more than
    that.

    Args:
        rows: trials of one plant and one reference mode.
        metric: its column.
        contenders: those that are compared; all ran all trials.

    Returns:
        None where the metric is defined for none of them.
    """
    table = _table(rows, metric, contenders)
    if table.empty:
        return None
    values, medians = table.to_numpy(), table.median().to_numpy()
    best = int(medians.argmin())
    leader = values[:, [best]]
    wins = (values - leader > SAME * np.abs(leader) + ROUNDING).sum(axis=0)
    losses = (leader - values > SAME * np.abs(values) + ROUNDING).sum(axis=0)
    value = float(medians[best])
    apart = (medians - value > SAME * abs(value) + ROUNDING) & (wins >= MOST * (wins + losses))
    names = [contender for contender in contenders if contender in table.columns]
    together = tuple(name for name, told in zip(names, apart, strict=True) if not told)
    if not apart.any():
        return Lead(together, value, None, float("nan"), 0, len(table))
    second = medians[apart].min()
    runner_up = int(np.argmax(apart & (medians <= second + SAME * abs(second))))
    return Lead(
        together,
        value,
        names[runner_up],
        float(medians[runner_up]),
        int(wins[runner_up]),
        len(table),
    )


def _table(rows: pd.DataFrame, metric: str, contenders: Sequence[Contender]) -> pd.DataFrame:
    """A metric with a row per scenario and seed and a column per law for which it is defined."""
    if not contenders:
        return pd.DataFrame()
    values = rows.set_index(["scenario", "seed", *CONTENDER])[metric]
    table = values[~values.index.duplicated()].unstack(CONTENDER)
    table = table.reindex(columns=pd.MultiIndex.from_tuples(contenders))
    return table.dropna(how="all").dropna(axis="columns")
