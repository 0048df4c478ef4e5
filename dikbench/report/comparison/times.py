"""Times of two folders: ratios only, with what speaks against comparing them."""

from __future__ import annotations

from collections.abc import Mapping
from types import MappingProxyType
from typing import Any, Final

import numpy as np
import pandas as pd

from dikbench.report.comparison.matching import MatchedTrials
from dikbench.results.columns import TIMED
from dikbench.statistics.hierarchical_bootstrap import draw_weights, mean_intervals
from dikbench.statistics.stability import STABLE

COMPARED: Final = ("formulation_time_median_us", "formulation_time_p99_us")

RATIOS: Final[Mapping[str, str]] = MappingProxyType(
    dict(zip(COMPARED, ("ratio", "p99_ratio"), strict=True))
)
"""The column of `time_ratios` of each column of times."""


def time_ratios(matched: MatchedTrials) -> pd.DataFrame:
    """A row per formulation and solver with times in both: geometric means over scenarios of B / A.

    Returns:
        Columns `formulation`, `solver`, `scenarios`, `ratio` of the medians with its interval
        `low`, `high`, `p99_ratio`, and `unstable`: at how many of the scenarios a time of A or of
        B is not stable.
    """
    wanted = [*COMPARED, "timing_stability"]
    if not all(name in rows for rows in (matched.a, matched.b) for name in wanted):
        return pd.DataFrame()
    a, b = (rows[[*TIMED, "scenario_family", *wanted]] for rows in (matched.a, matched.b))
    timed = (a[COMPARED[0]] > 0) & (b[COMPARED[0]] > 0) & ~a.duplicated(TIMED)
    rows: list[dict[str, Any]] = []
    for (formulation, solver), cells in a[timed].groupby(TIMED[:2], sort=False):
        other = b.loc[cells.index]
        logs = np.column_stack([np.log(other[name] / cells[name]) for name in COMPARED])
        weights = draw_weights(list(cells["scenario_family"]), list(cells["scenario"]))
        low, high = np.exp(mean_intervals(logs[:, :1], weights)[0])
        stable = cells["timing_stability"].eq(STABLE) & other["timing_stability"].eq(STABLE)
        ratio, p99_ratio = np.exp(logs.mean(axis=0))
        rows.append(
            {
                "formulation": formulation,
                "solver": solver,
                "scenarios": len(cells),
                "ratio": ratio,
                "low": low,
                "high": high,
                "p99_ratio": p99_ratio,
                "unstable": int((~stable).sum()),
            }
        )
    return pd.DataFrame(rows)


def untimed(matched: MatchedTrials) -> int:
    """Count the cells of trials in both that have times in A and none in B."""
    timed = [rows.get(COMPARED[0], pd.Series(dtype=float)).gt(0) for rows in (matched.a, matched.b)]
    return int((timed[0] & ~timed[1] & ~matched.a.duplicated(TIMED)).sum())
