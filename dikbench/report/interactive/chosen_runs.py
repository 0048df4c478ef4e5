"""The runs that the page carries: by a rule, so that there is something to compare."""

from __future__ import annotations

from typing import Final

import pandas as pd

MOST_RUNS: Final = 1200
"""Runs in a page: 2.2 kB each."""

MOST_SECONDS: Final = 18.0
"""Of control time together, by the rows: to run them again takes less, in lockstep."""

LONGEST_S: Final = 0.4
"""Of control time of one run."""

CASE: Final = ["scenario", "seed", "plant", "reference"]

RULE: Final = (
    "The page carries, on the ideal plant (or the first) and with the first solver of each "
    "formulation, its worst run in every situation and, where the path may wait, its median one; "
    "then the same cases under the other formulations; all of it as far as there is room, and "
    "without runs that take long to be computed again."
)


def chosen_runs(rows: pd.DataFrame, seconds: pd.Series) -> list[str]:
    """Choose the trials whose runs are carried (see `RULE`), by id.

    Args:
        rows: of the page.
        seconds: control time of each trial, by id.
    """
    plants = list(rows["plant"].unique())
    plant = "ideal" if "ideal" in plants else plants[0]
    open_ = rows[rows["first"].eq(1) & rows["plant"].eq(plant)]
    order = open_.assign(category=open_["outcomes"].str[0]).sort_values(
        ["category", "farthest"], kind="stable", na_position="last"
    )
    marked = set[str]()
    for (_, _, reference), runs in order.groupby(
        ["contender", "situation", "reference"], sort=False
    ):
        ids = runs["id"].tolist()
        marked |= {ids[-1]} if reference == "time" else {ids[-1], ids[(len(ids) - 1) // 2]}
    carries = order["id"].isin(marked)
    weight = carries.groupby([order[name] for name in CASE]).transform("sum")
    spent = order["id"].map(seconds).fillna(0.0)
    wanted = order.assign(marked=carries, weight=weight, seconds=spent)
    wanted = wanted[wanted["weight"].gt(0) & spent.le(LONGEST_S)].sort_values(
        ["marked", "weight", "reference", *CASE[:3]],
        ascending=[False, False, True, True, True, True],
        kind="stable",
    )
    taken = wanted.head(MOST_RUNS)
    return list(taken.loc[taken["seconds"].cumsum().le(MOST_SECONDS), "id"])
