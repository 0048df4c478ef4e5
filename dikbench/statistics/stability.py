"""Whether timings can be trusted: rules in the spirit of pyperf's, fit for microseconds."""

from __future__ import annotations

from typing import Final

import numpy as np

from dikbench.arrays import Array

STABLE: Final = "stable"

FEWEST_ROUNDS: Final = 3
FEWEST_SAMPLES: Final = 100

DRIFT: Final = 0.25
"""How far a round's median may lie from the median of all, as a share of it: machines change their
clock by more than half within minutes."""

SPREAD: Final = 0.5
"""How far apart the quartiles of all samples may lie, as a share of the median."""


def stability_of(samples: Array) -> str:
    """Judge the timings of one cell.

    Single slow samples are no fault of a measurement (they are what the quantiles report), and of
    calls this short the standard deviation says only that: hence medians and quartiles.

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
    if drift > DRIFT:
        return f"drift: a round's median is {100 * drift:.0f} % off the median of all"
    low, high = np.quantile(timed, (0.25, 0.75))
    spread = float(high - low) / middle
    if spread > SPREAD:
        return f"spread: the quartiles are {100 * spread:.0f} % of the median apart"
    return STABLE
