"""Success over several tolerances and both references: the one figure by which laws are tuned."""

from __future__ import annotations

from typing import Final, get_args

import numpy as np
import pandas as pd

from dikbench.statistics.accuracy import ACCURACY, SMALLEST_DISTANCE_M
from dikbench.statistics.success import Setting, counted, succeeded_at, with_facts
from dikbench.statistics.trial_matrix import CONTENDER

TOLERANCES_M: Final = (0.001, 0.002, 0.005, 0.01, 0.02)
"""The tolerances over which success is averaged."""

FARTHEST_M: Final = 1.0
"""The distance from the path of a trial without one: it counts as the worst."""

CASE: Final = ("scenario", "plant", "seed")
"""What makes a case here, of whichever reference."""


def mean_success(trials: pd.DataFrame) -> pd.DataFrame:
    """Average the success of each formulation in each case over tolerances and references.

    A case is a scenario and seed that a known motion can do. Its trials with either reference
    count alike; one that did not end well succeeds nowhere.

    Args:
        trials: rows of one plant and of one or both references.

    Returns:
        A row per case and formulation: the columns of `CASE` and `CONTENDER`, `scenario_family`,
        `robot`, `success` (0 to 1) and `log_distance`: the mean of ln of the largest distance from
        the path [m].
    """
    trials = with_facts(trials)
    settings: tuple[Setting, ...] = get_args(Setting)
    columns = [
        counted(trials, setting) for setting in settings if trials["reference"].eq(setting).any()
    ]
    rows = pd.concat(columns, ignore_index=True)
    away = rows[ACCURACY].clip(SMALLEST_DISTANCE_M, FARTHEST_M).fillna(FARTHEST_M)
    rows = rows.assign(
        success=np.mean([succeeded_at(rows, tolerance) for tolerance in TOLERANCES_M], axis=0),
        log_distance=np.log(away),
    )
    keys = [*CONTENDER, "scenario_family", "robot", *CASE]
    means: pd.DataFrame = rows.groupby(keys, sort=False)[["success", "log_distance"]].mean()
    return means.reset_index()
