"""Rates of success: which trials count, hierarchical means, paired differences to the best.

A rate is the mean over families of the means over robots of the means over scenarios of the means
over seeds, so that no family counts for more because it has more scenarios. Its intervals are drawn
at the same levels. Only trials count of scenarios that a known motion can do; of the others nobody
knows whether anything can be done.
"""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import dataclass, replace
from typing import Any, Final, Literal

import numpy as np
import pandas as pd

from dikbench.arrays import Array, Mask
from dikbench.metrics import Judgement, Outcome
from dikbench.scenario.oracle import ORACLES
from dikbench.statistics.failures import SKIPPED
from dikbench.statistics.hierarchical_bootstrap import INTERVAL_COVERAGE, draw_weights
from dikbench.statistics.trial_matrix import TrialMatrix

Setting = Literal["path", "time"]
"""Whether the path may wait, or the clock does not wait."""

Contender = tuple[str, str]
"""A formulation and its solver."""

DONE: Final = frozenset({Outcome.SUCCESS.value, Outcome.RECOVERED.value})
"""The outcomes of trials in which the robot did its job."""

FACTS: Final = ("robot", "feasible", "situation", "judged_by_path", "tolerance_m", "speed_need")
"""Columns that are the same in all trials of a scenario and seed."""

LEVELS: Final = ("scenario_family", "robot", "scenario")
"""What trials are averaged over, and drawn at, from the outside in; seeds come last."""

MOST_BEHIND: Final = 0.1
"""Who is as good as the best has a rate at most this much below it, however few the cases are."""


def with_facts(trials: pd.DataFrame) -> pd.DataFrame:
    """Fill in what trials that did not run lack of their scenario, from those that did."""
    texts = trials[list(FACTS)].replace("", np.nan)
    filled = texts.groupby([trials["scenario"], trials["seed"]], sort=False).transform("first")
    whole = trials.copy()  # in one block, whatever was added to it before
    return whole.assign(**{name: filled[name] for name in FACTS})


def counted(trials: pd.DataFrame, setting: Setting) -> pd.DataFrame:
    """Return the trials that count in a setting.

    They are those with this reference, and in both settings those of targets at rest, of scenarios
    that a known motion can do. Where a formulation was skipped since it does not see the distances
    or torques, it did not succeed.

    Args:
        trials: rows of one plant, with the facts of their scenarios.
        setting: whether the path may wait.
    """
    rows = trials[trials["outcome"].eq(Outcome.DOES_NOT_SEE) | ~trials["status"].eq(SKIPPED)]
    at_rest = rows["judged_by_path"].eq(0) & rows["reference"].eq("time")
    feasible = rows["feasible"].isin(["time", "path"])
    found: pd.DataFrame = rows[feasible & (rows["reference"].eq(setting) | at_rest)]
    return found


def succeeded(trials: pd.DataFrame) -> Mask:
    """Say of each trial whether the robot did its job, at the scenario's own tolerance."""
    done: Mask = trials["outcome"].isin(DONE).to_numpy()
    return done


def succeeded_at(trials: pd.DataFrame, tolerance: float) -> Mask:
    """Say of each trial whether the robot would have done its job at a tolerance [m]."""
    rows: list[Any] = trials.to_dict("records")
    return np.array([Judgement.of_row(row).at(tolerance).outcome.value in DONE for row in rows])


ROUNDING: Final = 1e-9
"""Rates that differ by less are the same."""


@dataclass(frozen=True, eq=False)
class Rates:
    """The rates of success of formulations over the same cases.

    Attributes:
        layout: the place of each trial in matrices of cases x formulations.
        base: weight of each case, (n,).
        drawn: weights of the cases in each resample, (resamples, n).
        contenders: a row per formulation and solver.
        rate: the rate of each, (k,); NaN where it ran no trial.
        trials: number of its trials, (k,).
        whole: whether it ran every case, (k,).
        difference: of its rate to that of the best that competes, over the cases of both, (k,).
        lower, upper: the paired 95 % interval of that, (k,).
        best: whether it competes and is the best, or cannot be told apart from it, is at most
            `MOST_BEHIND` behind it, and at least as good as everybody that can be told apart.
    """

    layout: TrialMatrix
    base: Array
    drawn: Array
    contenders: pd.DataFrame
    rate: Array
    trials: Array
    whole: Mask
    difference: Array
    lower: Array
    upper: Array
    best: Mask


def rates(
    trials: pd.DataFrame, done: Mask | Array, candidates: Collection[Contender] | None = None
) -> Rates:
    """Compute the rates of success of every formulation, and compare each with the best.

    The intervals are those of paired differences under a bootstrap over families, robots, scenarios
    and seeds. Who did not run every case does not compete, nor do oracles.

    Args:
        trials: rows that count (see `counted`).
        done: whether the robot did its job in each, or how well (0 to 1).
        candidates: who competes; default: everybody that can. Where none of them can, the rates
            are compared with the best of all, and nobody is `best`.
    """
    layout = TrialMatrix.of(trials)
    matrix = layout.fill(done.astype(float))
    cases = case_facts(trials, layout)
    base = hierarchical_weights(cases)
    rate, ran_there = weighted_means(matrix, base), ~np.isnan(matrix)
    whole: Mask = np.asarray(ran_there.all(axis=0))
    competes: Mask = whole & ~layout.contenders["formulation"].isin(ORACLES).to_numpy()
    may_win = competes
    if candidates is not None:
        pairs = layout.contenders.itertuples(index=False, name=None)
        may_win = competes & np.array([pair in candidates for pair in pairs], dtype=bool)
        competes = may_win if may_win.any() else competes
    nothing = np.full(len(rate), np.nan)
    drawn = draw_weights(*(list(cases[level]) for level in LEVELS)) * base
    found = Rates(
        layout, base, drawn, layout.contenders, rate, ran_there.sum(axis=0), whole,
        nothing, nothing, nothing, np.zeros(len(rate), dtype=bool),
    )  # fmt: skip
    if not competes.any():
        return found
    first = int(np.flatnonzero(competes & (rate >= rate[competes].max() - ROUNDING))[0])
    difference, lower, upper = paired_means(matrix - matrix[:, [first]], found)
    told_apart = rate[competes & (upper < 0)]
    at_least = max(told_apart.max(initial=0.0), rate[first] - MOST_BEHIND - ROUNDING)
    best: Mask = np.asarray(may_win & (upper >= 0) & (rate > 0) & (rate >= at_least))
    return replace(found, difference=difference, lower=lower, upper=upper, best=best)


def paired_means(differences: Array, found: Rates) -> tuple[Array, Array, Array]:
    """Compute hierarchical means of paired differences and their 95 % intervals, (k,) each.

    Args:
        differences: of each case and formulation, (n, k); NaN where one of the two has no value.
        found: the rates whose cases these are.
    """
    means = weighted_means(differences, found.base)
    resampled = weighted_means(differences, found.drawn)
    tails = ((1 - INTERVAL_COVERAGE) / 2, (1 + INTERVAL_COVERAGE) / 2)
    lower, upper = np.full((2, len(means)), np.nan)
    defined = ~np.isnan(means)
    if defined.any():
        lower[defined], upper[defined] = np.nanquantile(resampled[:, defined], tails, axis=0)
    return means, lower, upper


def hierarchical_weights(cases: pd.DataFrame) -> Array:
    """Compute the weight of each case in the mean over `LEVELS` and the cases below, (n,)."""
    weights = np.ones(len(cases))
    above: list[tuple[Any, ...]] = [()] * len(cases)
    numbers = range(len(cases))
    for column in (*(cases[level].astype(str).tolist() for level in LEVELS), numbers):
        inside = [(*key, value) for key, value in zip(above, column, strict=True)]
        count: dict[tuple[Any, ...], int] = {}
        for key in dict.fromkeys(inside):
            count[key[:-1]] = count.get(key[:-1], 0) + 1
        weights /= [count[key] for key in above]
        above = inside
    return weights


def case_facts(trials: pd.DataFrame, layout: TrialMatrix) -> pd.DataFrame:
    """Return the family, robot and scenario of each row of the matrix."""
    first = trials.assign(row=layout.row).drop_duplicates("row").sort_values("row")
    found: pd.DataFrame = first[list(LEVELS)].fillna("").reset_index(drop=True)
    return found


def weighted_means(values: Array, weights: Array) -> Array:
    """Compute the weighted mean of each column over its numbers, (k,)."""
    defined = ~np.isnan(values)
    with np.errstate(invalid="ignore"):
        means: Array = (weights @ np.where(defined, values, 0.0)) / (
            weights @ defined.astype(float)
        )
    return means
