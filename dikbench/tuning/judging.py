"""What is best of what was tried, and how much tuning brings."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import pandas as pd

from dikbench.arrays import Array
from dikbench.errors import DikbenchError
from dikbench.selector import Selector
from dikbench.statistics.mean_success import mean_success
from dikbench.statistics.success import ROUNDING, rates


@dataclass(frozen=True, eq=False)
class Scores:
    """How well a formulation did at its default and at each candidate.

    Attributes:
        default: the formulation as it was given.
        candidates: what was tried, in order.
        success: mean success of the default, then of each candidate, (1 + n,).
        log_distance: mean of ln of the largest distance from the path [m], likewise.
        cases: number of cases.
    """

    default: Selector
    candidates: Sequence[Selector]
    success: Array
    log_distance: Array
    cases: int

    @property
    def best(self) -> Selector:
        """The best of the default and all candidates."""
        return self._named(self._first(len(self.success)))

    @property
    def worst(self) -> Selector:
        """The worst of the candidates; the default is none of them."""
        order = np.lexsort((-self.log_distance[1:], self.success[1:]))
        return self.candidates[int(order[0])]

    @property
    def best_success(self) -> float:
        """The success of the best."""
        return float(self.success.max())

    @property
    def half_success(self) -> float:
        """The success of the best within the first half of the budget."""
        return float(self.success[: 1 + len(self.candidates) // 2].max())

    def _first(self, number: int) -> int:
        """Return the place of the best of the first ones: by success, then by distance."""
        level = self.success[:number].max() - ROUNDING
        if level <= 0:  # where nothing succeeds nothing is better than the default
            return 0
        ties = np.flatnonzero(self.success[:number] >= level)
        return int(ties[np.argmin(self.log_distance[ties])])

    def _named(self, place: int) -> Selector:
        return self.default if place == 0 else self.candidates[place - 1]


def scores(trials: pd.DataFrame, default: Selector, candidates: Sequence[Selector]) -> Scores:
    """Score a formulation at its default and at each candidate.

    The success is the mean over the tolerances and both references, then over families, robots
    and scenarios (see `dikbench.statistics.success`).

    Args:
        trials: rows of the train split, of one solver, and of an oracle.
        default: the formulation as it was given.
        candidates: what was tried.

    Raises:
        DikbenchError: if no scenario counts.
    """
    names = [str(default), *map(str, candidates)]
    frame, own = mean_success(trials, names), trials[trials["formulation"].isin(names)]
    if frame.empty or not own["status"].eq("ok").any():
        reasons = own["status"] + ": " + own["message"]
        raise DikbenchError(
            f"{default}: no trial counts: {reasons.mode().iloc[0]}; valid: a formulation that "
            "runs, on scenarios that a known motion can do"
        )
    success, weighed = (
        rates(frame, frame[column].to_numpy()) for column in ("success", "log_distance")
    )
    places = pd.Index(success.contenders["formulation"]).get_indexer(pd.Index(names))
    return Scores(
        default, candidates, success.rate[places], weighed.rate[places], len(success.layout.cases)
    )


@dataclass(frozen=True)
class Gain:
    """The success of a formulation on the test split.

    Attributes:
        default, tuned, worst: at its default, its tuned and its worst parameters.
        difference, lower, upper: tuned less default, with its paired 95 % interval.
        cases: number of cases.
    """

    default: float
    tuned: float
    worst: float
    difference: float
    lower: float
    upper: float
    cases: int


def gain(trials: pd.DataFrame, scored: Scores) -> Gain:
    """Compare a formulation at its default, tuned and worst parameters on the test split.

    Args:
        trials: rows of the test split, of one solver.
        scored: how it did on the train split.
    """
    names = [str(each) for each in (scored.default, scored.best, scored.worst)]
    frame = mean_success(trials, names)
    first = frame[frame["formulation"].eq(names[0])].iloc[0]
    found = rates(frame, frame["success"].to_numpy(), [(names[0], str(first["solver"]))])
    at = pd.Index(found.contenders["formulation"]).get_indexer(pd.Index(names))
    default, tuned, worst = (float(rate) for rate in found.rate[at])
    difference, lower, upper = (
        float(values[at[1]]) for values in (found.difference, found.lower, found.upper)
    )
    return Gain(default, tuned, worst, difference, lower, upper, len(found.layout.cases))
