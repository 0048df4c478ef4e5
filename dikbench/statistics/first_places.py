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

That one is first does not say that the others are worse: `places` tells in addition whom the rows
do not exclude, however far its rate is behind, and who leads where a robot or a family is left out.
"""

from __future__ import annotations

from collections.abc import Collection
from typing import Final

import numpy as np
import pandas as pd

from dikbench.arrays import Array, Mask
from dikbench.metrics import Outcome
from dikbench.scenario.oracle import ORACLES
from dikbench.statistics.leaving_out import without_each
from dikbench.statistics.success import Contender, Rates, paired_means, rates, succeeded
from dikbench.statistics.trial_matrix import CONTENDER

SMALLEST_SHARE_OF_BEST: Final = 0.5
"""Who is first somewhere has an overall rate above this share of the best one's."""

MOST_BROKEN_SHARE: Final = 0.05
"""... and breaks limits or breaks off in at most this share of the trials."""

FEWEST_SCENARIOS: Final = 5
"""In situations of fewer scenarios nobody is first."""

MOST_HELD_BACK_SHARE: Final = 0.25
"""Who is stopped more often than that, but in at most this share, is named where it does as well as
who is first (see `held_back`)."""

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
    least, rate_of, stopped = _records(trials, of_all_settings)
    return {
        name
        for name, rate in rate_of.items()
        if rate > least and stopped[name] <= MOST_BROKEN_SHARE
    }


def held_back(trials: pd.DataFrame, of_all_settings: pd.DataFrame) -> dict[Contender, float]:
    """Find who would be dependable but for being stopped somewhat too often.

    Args:
        trials: as of `dependable`.
        of_all_settings: likewise.

    Returns:
        The share of its trials in which each is stopped, above `MOST_BROKEN_SHARE` and at most
        `MOST_HELD_BACK_SHARE`.
    """
    least, rate_of, stopped = _records(trials, of_all_settings)
    return {
        name: stopped[name]
        for name, rate in rate_of.items()
        if rate > least and MOST_BROKEN_SHARE < stopped[name] <= MOST_HELD_BACK_SHARE
    }


def _records(
    trials: pd.DataFrame, of_all_settings: pd.DataFrame
) -> tuple[float, dict[Contender, float], dict[Contender, float]]:
    """Compute the rate that is asked for, and of who ran all cases its rate and share stopped."""
    moving = trials[_asks_for_motion(trials)]
    if moving.empty:
        return 0.0, {}, {}
    overall = rates(moving, succeeded(moving))
    told = ~of_all_settings["sees_constraints"].eq(0)
    is_stopped = of_all_settings["outcome"].isin(BROKEN) & told
    share = is_stopped.groupby([of_all_settings[name] for name in CONTENDER]).mean()
    rate_of = {
        contender: float(rate)
        for contender, rate, whole in zip(
            overall.contenders.itertuples(index=False, name=None),
            overall.rate,
            overall.whole,
            strict=True,
        )
        if whole and contender[0] not in ORACLES
    }
    stopped = {name: float(share[name]) for name in rate_of}
    best = max((r for n, r in rate_of.items() if stopped[n] <= MOST_BROKEN_SHARE), default=0.0)
    return SMALLEST_SHARE_OF_BEST * best, rate_of, stopped


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
    return places(part, found, found.best)[0]


def places(part: pd.DataFrame, found: Rates, rivals: Mask) -> tuple[Mask, Mask]:
    """Say who is first in a situation, and who of the rivals may be for all that the rows say.

    Args:
        part: the rows of the situation that count.
        found: their rates of success, among the rivals.
        rivals: who may be first, (k,).

    Returns:
        Who is first (see `first_places`), and, these included, of whom nobody is beyond doubt more
        successful (the interval of its difference to the best holds 0) or as good and faster, or
        who alone leads where a robot or a family is left out and enough scenarios stay; (k,) each,
        nobody where there are too few scenarios.
    """
    if too_few(part):
        nobody = np.zeros(len(found.best), dtype=bool)
        return nobody, nobody
    not_slower = ~_slower(part, found)
    not_worse = rivals & (found.upper >= 0)
    may_lead = (found.best | not_worse) & not_slower
    for without in without_each(part, found):
        leaders = without.leaders(rivals)
        if without.scenarios >= FEWEST_SCENARIOS and not (leaders & may_lead).any():
            may_lead = may_lead | leaders
    return found.best & not_slower, may_lead


def _asks_for_motion(trials: pd.DataFrame) -> pd.Series:
    """Say which trials are of cases that standing still does not do: of others nobody learns.

    A target at rest is near enough at the start where some robot never was farther from it than
    the tolerance.
    """
    least = trials.groupby(["scenario", "seed"])["tracking_error_6d_max_m"].transform("min")
    at_rest = trials["judged_by_path"].eq(0)
    found: pd.Series = ~(at_rest & least.le(trials["tolerance_m"].astype(float)))
    return found


def _slower(part: pd.DataFrame, found: Rates) -> Mask:
    """Say who is slower than one of the best, beyond doubt, where both succeed, (k,)."""
    slower = np.zeros(len(found.best), dtype=bool)
    duration = part["slow_down"].where(succeeded(part))
    values = np.log(duration.to_numpy(dtype=float))
    if np.isnan(values).all():
        return slower
    matrix: Array = found.layout.fill(values)
    for other in np.flatnonzero(found.best):
        means, lower, _ = paired_means(matrix - matrix[:, [other]], found)
        slower |= (lower > 0) & (means > np.log(FASTER))
    return slower
