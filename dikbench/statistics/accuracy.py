"""Accuracy: how far from their paths formulations were at most, where they succeeded."""

from __future__ import annotations

from typing import Final

import numpy as np
import pandas as pd

from dikbench.arrays import Array
from dikbench.statistics.success import succeeded

ACCURACY: Final = "contour_error_6d_max_m"
"""What is compared: the largest distance from the path in a run."""

SMALLEST_DISTANCE_M: Final = 1e-5
"""Distances below this count as this, so that two of them tie: what is left is the sampling."""


def log_distances(trials: pd.DataFrame) -> Array:
    """Compute ln of the largest distance from the path [m] of each trial, (n,).

    NaN where the robot did not do its job, and where the target is at rest, which has no path. A
    mean of differences of these is the logarithm of a paired geometric mean of ratios.
    """
    away = trials[ACCURACY].clip(lower=SMALLEST_DISTANCE_M)
    away = away.where(succeeded(trials) & trials["judged_by_path"].eq(1))
    logarithms: Array = np.log(away.to_numpy(dtype=float))
    return logarithms
