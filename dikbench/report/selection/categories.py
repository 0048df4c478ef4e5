"""What became of a trial, in one word: the categories of a phase diagram."""

from __future__ import annotations

from typing import Final

import numpy as np
import pandas as pd

CATEGORIES: Final = ("ok", "slow", "off course", "violating", "failed")
"""From the best to the worst; a trial is the worst that applies."""

SLOW: Final = 0.9
"""A trial is slow if at some step it makes less than this share of the wanted motion ..."""

OFF_COURSE: Final = np.radians(10.0)
"""... off course if at some step it moves farther than this from the wanted direction [rad] ..."""

VIOLATING: Final = 0.0
"""... and violating if more than this share of its steps pass a limit (by > 1e-4)."""


def categories(rows: pd.DataFrame) -> pd.Series:
    """The outcome of each trial, as its place in `CATEGORIES`."""
    conditions = [
        rows["status"].ne("ok"),
        rows["violating_share"].gt(VIOLATING),
        rows["direction_error_max_rad"].gt(OFF_COURSE),
        rows["progress_min"].lt(SLOW),
    ]
    return pd.Series(np.select(conditions, [4, 3, 2, 1], default=0), index=rows.index)
