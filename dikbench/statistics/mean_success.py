"""Success over several tolerances and both references: the one figure by which laws are tuned."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Final, get_args

import numpy as np
import pandas as pd

from dikbench.statistics.accuracy import ACCURACY, SMALLEST_DISTANCE_M
from dikbench.statistics.failures import SKIPPED, has_failed
from dikbench.statistics.success import Setting, succeeded_at, with_facts
from dikbench.statistics.trial_matrix import CONTENDER

TOLERANCES_M: Final = (0.001, 0.002, 0.005, 0.01, 0.02)
"""The tolerances over which success is averaged."""

FARTHEST_M: Final = 1.0
"""The distance from the path of a trial without one: it counts as the worst."""

KEYS: Final = ("scenario_family", "robot", "scenario", "plant", "seed")
"""What makes a case here, of whichever reference."""


def mean_success(trials: pd.DataFrame, formulations: Sequence[str]) -> pd.DataFrame:
    """Average the success of formulations in each case over tolerances and references.

    A case is a scenario and seed that a known motion can do. Its trials with either reference
    count alike; one that failed, or was refused, succeeds nowhere and is as far away as can be, so
    that nobody gains by refusing.

    Args:
        trials: rows of one plant and of one or both references, of these formulations and of
            others, from which the facts of a scenario are known that all of these refuse.
        formulations: their selectors.

    Returns:
        A row per case and formulation: the columns of `KEYS` and `CONTENDER`, `success` (0
        to 1) and `log_distance`: the mean of ln of the largest distance from
        the path [m].
    """
    trials = with_facts(trials)
    trials = trials[trials["formulation"].isin(formulations)]
    trials = trials[trials["feasible"].isin(["time", "path"])]
    settings: tuple[Setting, ...] = get_args(Setting)
    at_rest = trials["judged_by_path"].eq(0) & trials["reference"].eq("time")
    columns = [
        trials[trials["reference"].eq(setting) | at_rest]
        for setting in settings
        if trials["reference"].eq(setting).any()
    ]
    if not columns:
        return pd.DataFrame(columns=[*CONTENDER, *KEYS, "success", "log_distance"])
    rows = pd.concat(columns, ignore_index=True)
    # At rest there is one run, which counts in both columns; the other is skipped for all.
    rows = rows[~(rows["judged_by_path"].eq(0) & rows["reference"].eq("path"))]
    ended = rows["status"].ne(SKIPPED) & ~has_failed(rows)
    away = rows[ACCURACY].where(ended).clip(SMALLEST_DISTANCE_M, FARTHEST_M).fillna(FARTHEST_M)
    success = np.mean([succeeded_at(rows, tolerance) for tolerance in TOLERANCES_M], axis=0)
    rows = rows.assign(success=np.where(ended, success, 0.0), log_distance=np.log(away))
    means: pd.DataFrame = rows.groupby([*CONTENDER, *KEYS], sort=False)[
        ["success", "log_distance"]
    ].mean()
    return means.reset_index()
