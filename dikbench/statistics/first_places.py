"""Who may be called first in a situation: a tie for success is not enough.

A formulation may be first (see `dependable`) only if it ran every case and

- is stopped by limits that it is told of, by collisions or failures in at most 5 % of its trials:
  who ignores limits is accurate where none is near;
- succeeds, over all cases that ask for motion, in more than half of what the best of those
  succeeds in: who stands still holds a pose well.

Of these it is first in a situation if its success cannot be told apart from the best and is nearly
as large (see `rates`), and no other of them is faster beyond doubt, where the path may wait. Nobody
is first in a situation of a few scenarios: an interval over so few is as wide as it is unreliable,
and seeds of a scenario are too much alike to make up for it. Nothing else is compared, so that rows
of formulations that may not be first change nothing.
"""

from __future__ import annotations

from collections.abc import Collection
from typing import Final

import numpy as np
import pandas as pd

from dikbench.arrays import Array, Mask
from dikbench.metrics import Outcome
from dikbench.scenario.oracle import ORACLES
from dikbench.statistics.success import Contender, Rates, paired_means, rates, succeeded
from dikbench.statistics.trial_matrix import CONTENDER

SMALLEST_SHARE_OF_BEST: Final = 0.5
"""Who is first somewhere has an overall rate above this share of the best one's."""

MOST_BROKEN_SHARE: Final = 0.05
"""... and breaks limits or breaks off in at most this share of the trials."""

FEWEST_SCENARIOS: Final = 5
"""In situations of fewer scenarios nobody is first."""

FASTER: Final = 1.05
"""A path is done faster where its duration is smaller by more than this ratio."""

BROKEN: Final = frozenset(
    {
        Outcome.DID_NOT_RUN.value,
        Outcome.DIVERGED.value,
        Outcome.COLLIDED.value,
        Outcome.LIMIT_BROKEN.value,
    }
)
"""Outcomes of trials in which a robot is stopped."""


def dependable(trials: pd.DataFrame, of_all_settings: pd.DataFrame) -> set[Contender]:
    """Find the formulations that may be first in a situation of a setting.

    Args:
        trials: the rows that count in the setting, of all situations.
        of_all_settings: those that count in any setting, over which it is counted who is stopped.
    """
    moving = trials[_asks_for_motion(trials)]
    if moving.empty:
        return set()
    overall = rates(moving, succeeded(moving))
    told = ~of_all_settings["sees_constraints"].eq(0)
    stopped = of_all_settings["outcome"].isin(BROKEN) & told
    share = stopped.groupby([of_all_settings[name] for name in CONTENDER]).mean()
    rate_of = {
        contender: float(rate)
        for contender, rate, whole in zip(
            overall.contenders.itertuples(index=False, name=None),
            overall.rate,
            overall.whole,
            strict=True,
        )
        if whole and contender[0] not in ORACLES and share[contender] <= MOST_BROKEN_SHARE
    }
    most = max(rate_of.values(), default=0.0)
    return {name for name, rate in rate_of.items() if rate > SMALLEST_SHARE_OF_BEST * most}


def told_of(part: pd.DataFrame, candidates: Collection[Contender]) -> set[Contender]:
    """Leave out the formulations that are not told of the distances or torques of a situation."""
    untold = part.loc[part["sees_constraints"].eq(0), CONTENDER].itertuples(index=False, name=None)
    return set(candidates) - set(untold)


def too_few(part: pd.DataFrame) -> bool:
    """Say whether a situation, of which these rows count, has too few scenarios for a first one."""
    return part["scenario"].nunique() < FEWEST_SCENARIOS


def first_places(part: pd.DataFrame, found: Rates) -> Mask:
    """Say who is first in a situation, (k,); nobody where there are too few scenarios.

    Args:
        part: the rows of the situation that count.
        found: their rates of success, among those that may be first.
    """
    if too_few(part):
        return np.zeros(len(found.best), dtype=bool)
    return found.best & ~_slower(part, found, found.best)


def _asks_for_motion(trials: pd.DataFrame) -> pd.Series:
    """Say which trials are of cases that standing still does not do: of others nobody learns.

    A target at rest is near enough at the start where some robot never was farther from it than
    the tolerance.
    """
    least = trials.groupby(["scenario", "seed"])["tracking_error_6d_max_m"].transform("min")
    at_rest = trials["judged_by_path"].eq(0)
    found: pd.Series = ~(at_rest & least.le(trials["tolerance_m"].astype(float)))
    return found


def _slower(part: pd.DataFrame, found: Rates, first: Mask) -> Mask:
    """Say who is slower than another of the first, beyond doubt, where both succeed."""
    slower = np.zeros(len(first), dtype=bool)
    duration = part["slow_down"].where(succeeded(part))
    values = np.log(duration.to_numpy(dtype=float))
    if np.isnan(values).all():
        return slower
    matrix: Array = found.layout.fill(values)
    for other in np.flatnonzero(first):
        means, lower, _ = paired_means(matrix - matrix[:, [other]], found)
        slower |= (lower > 0) & (means > np.log(FASTER))
    return slower & first
