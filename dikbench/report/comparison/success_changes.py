"""Rates of success of two folders, over the trials that both have."""

from __future__ import annotations

from typing import Any, Final, get_args

import pandas as pd

from dikbench.report.comparison.matching import MatchedTrials
from dikbench.statistics.success import (
    FACTS,
    Setting,
    counted,
    hierarchical_weights,
    succeeded,
    with_facts,
)

GROUPS: Final = ["formulation", "solver", "plant"]


def success_changes(matched: MatchedTrials) -> pd.DataFrame:
    """Compute the rates of success in A and in B of every formulation and setting.

    What counts, and for how much, is as A says (see `counted` and `hierarchical_weights`).

    Returns:
        Columns `GROUPS`, `setting` (path or time), `trials`, `rate_a`, `rate_b`, `lost` and
        `gained`: trials that succeed in A or B only; empty where a folder has no outcomes.
    """
    needed = {"outcome", *FACTS}
    if not needed <= {*matched.a} or not needed <= {*matched.b}:
        return pd.DataFrame()
    facts = with_facts(matched.a)
    rows: list[dict[str, Any]] = []
    for setting in get_args(Setting):
        here = counted(facts, setting)
        for group, part in here.groupby(GROUPS, sort=False):
            weights = hierarchical_weights(part)
            before, after = succeeded(part), succeeded(matched.b.loc[part.index])
            rows.append(
                {
                    **dict(zip(GROUPS, group, strict=True)),
                    "setting": setting,
                    "trials": len(part),
                    "rate_a": float(weights @ before),
                    "rate_b": float(weights @ after),
                    "lost": int((before & ~after).sum()),
                    "gained": int((~before & after).sum()),
                }
            )
    return pd.DataFrame(rows)
