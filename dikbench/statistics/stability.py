"""Stability of timings: rules like pyperf's, adapted to microseconds."""

from __future__ import annotations

from typing import Final

import numpy as np

from dikbench.arrays import Array

STABLE: Final = "stable"

FEWEST_ROUNDS: Final = 3
FEWEST_SAMPLES: Final = 100

LARGEST_DRIFT_SHARE: Final = 0.25
"""Largest distance of a round's median from the median of all, as a share of it."""

LARGEST_SPREAD_SHARE: Final = 0.5
"""Largest distance between the quartiles of all samples, as a share of the median."""


def stability_of(samples: Array) -> str:
    """Judge the timings of one cell.

    Medians and quartiles are used, since the standard deviation of such short calls depends on
    single slow samples, which the quantiles report.

    Args:
        samples: times, (rounds, problems); NaN where the formulation broke.

    Returns:
        "stable", or what is wrong, with figures.
    """
    timed = samples[~np.isnan(samples)]
    if len(timed) < samples.size:
        return f"broke off: {len(timed)} of {samples.size} problems were timed"
    if len(samples) < FEWEST_ROUNDS or len(timed) < FEWEST_SAMPLES:
        return (
            f"few samples: {len(timed)} in {len(samples)} rounds, wanted {FEWEST_SAMPLES} in "
            f"{FEWEST_ROUNDS}"
        )
    middle = float(np.median(timed))
    drift = float(np.abs(np.median(samples, axis=1) - middle).max()) / middle
    if drift > LARGEST_DRIFT_SHARE:
        return f"drift: a round's median is {100 * drift:.0f} % off the median of all"
    low, high = np.quantile(timed, (0.25, 0.75))
    spread = float(high - low) / middle
    if spread > LARGEST_SPREAD_SHARE:
        return f"spread: the quartiles are {100 * spread:.0f} % of the median apart"
    return STABLE
