"""The treatment of failed trials.

A failed trial is never dropped and never turned into a time:

- it counts in the failure rate, which comes first in every table;
- in an average it takes its metric's `worst` value where that is finite (pi for an angle, 1 for a
  share of violating steps, 0 for a share of success); where it is infinite an average cannot carry
  it and leaves it out, and such an average is not compared with those of other formulations;
- in an extreme (the worst over scenarios) it takes the `worst` value, infinite or not;
- in a performance or data profile it is a problem that was not solved: an infinite ratio.

The record of a failed trial is not used: it would favour early failures. A skipped trial is not a
failure, since its cell cannot work; it counts in profiles only, which compare formulations on the
same problems, as not solved.
"""

from __future__ import annotations

import numpy as np
import pandas as pd

from dikbench.arrays import Array, Mask
from dikbench.metrics import METRICS
from dikbench.simulation.status import Status

SKIPPED = Status.SKIPPED.value


def ran(trials: pd.DataFrame) -> pd.DataFrame:
    """Return the rows of trials that were not skipped."""
    rows: pd.DataFrame = trials[trials["status"] != SKIPPED]
    return rows


def has_failed(trials: pd.DataFrame) -> Mask:
    """Say whether each trial failed: neither ran to its end nor was skipped."""
    failed: Mask = ~trials["status"].isin([Status.OK.value, SKIPPED]).to_numpy()
    return failed


def worst_value(metric: str) -> float:
    """Return what a failed trial counts for in a metric; infinity for a column of times."""
    return METRICS[metric].worst if metric in METRICS else np.inf


def failures_at_worst(trials: pd.DataFrame, metric: str) -> Array:
    """Return a metric of each trial, failed ones at its worst value, which may be infinite."""
    recorded = trials[metric].to_numpy(dtype=float)
    return np.where(has_failed(trials), worst_value(metric), recorded)
