"""What a conclusion hangs on, in words: a robot, a family, a convention."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, Final

import pandas as pd

from dikbench.arrays import Mask
from dikbench.report.selection.judged import IN_WORDS
from dikbench.report.sentences.words import Names, listed, number, several
from dikbench.scenario.oracle import ORACLES
from dikbench.statistics.first_places import FEWEST_SCENARIOS
from dikbench.statistics.leaving_out import without_each
from dikbench.statistics.rank_agreement import rank_agreement
from dikbench.statistics.success import ROUNDING, Contender, Rates, Setting

LEADS: Final = 3
"""So many robots and families are told that change who has the highest rate; others are counted."""


def without_one(
    part: pd.DataFrame, found: Rates, rivals: Mask, every: Sequence[Contender], names: Names
) -> str:
    """Say who has the highest rate instead where a robot or a family is left out.

    Args:
        part: the rows of a situation that count.
        found: their rates.
        rivals: who may be first, (k,).
        every: the formulations, (k,).
        names: how they are called.
    """
    most = found.rate[rivals].max() - ROUNDING
    told = []
    for without in without_each(part, found):
        leaders = without.leaders(rivals)
        if without.scenarios >= FEWEST_SCENARIOS and not (found.rate[leaders] >= most).any():
            led = names.of(each for each, leads in zip(every, leaders, strict=True) if leads)
            told.append(f"{led} without the {without.kind} {without.name}")
    return f"; highest is {listed(told, LEADS)}" if told else ""


def hangs_on_conventions(of_setting: Mapping[Setting, pd.DataFrame]) -> str:
    """Say how alike the order of formulations is at other values of parameters of all scenarios.

    Args:
        of_setting: the rows that count, by setting.
    """
    told = []
    for setting, rows in of_setting.items():
        agreement = rank_agreement(rows[~rows["formulation"].isin(ORACLES)])
        lines: list[dict[Any, Any]] = agreement.to_dict("records")
        told += [
            f"where {IN_WORDS[setting]}, `{row['parameter']}` {row['value']} against "
            f"{row['against']}: Kendall's tau {number(row['kendall'])} of the rates of "
            f"{row['formulations']} formulations over {several(row['scenarios'], 'scenario')}, of "
            f"which none changes by more than {number(100 * row['largest_change'])} points"
            for row in lines
        ]
    return f"{'; '.join(told)}." if told else ""
