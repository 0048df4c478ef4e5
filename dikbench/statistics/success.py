"""Rates of success: which trials count, hierarchical means, paired differences to the best.

A rate is the mean over families of the means over robots of the means over scenarios of the means
over seeds, so that no family counts for more because it has more scenarios. Only trials count of
scenarios that a known motion can do; of the others nobody knows whether anything can be done.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Final, Literal

import numpy as np
import pandas as pd

from dikbench.arrays import Array, Mask
from dikbench.metrics import Judgement, Outcome
from dikbench.scenario.oracle import ORACLES
from dikbench.statistics.failures import ran
from dikbench.statistics.hierarchical_bootstrap import INTERVAL_COVERAGE, draw_weights
from dikbench.statistics.trial_matrix import TrialMatrix

Setting = Literal["path", "time"]
"""Whether the path may wait, or the clock does not wait."""

DONE: Final = frozenset({Outcome.SUCCESS.value, Outcome.RECOVERED.value})
"""The outcomes of trials in which the robot did its job."""

FACTS: Final = ("robot", "feasible", "situation", "judged_by_path", "tolerance_m", "speed_need")
"""Columns that are the same in all trials of a scenario and seed."""

LEVELS: Final = ("scenario_family", "robot", "scenario")
"""What trials are averaged over, from the outside in; seeds come last."""


def with_facts(trials: pd.DataFrame) -> pd.DataFrame:
    """Fill in what trials that did not run lack of their scenario, from those that did."""
    texts = trials[list(FACTS)].replace("", np.nan)
    filled = texts.groupby([trials["scenario"], trials["seed"]], sort=False).transform("first")
    return trials.assign(**{name: filled[name] for name in FACTS})


def counted(trials: pd.DataFrame, setting: Setting) -> pd.DataFrame:
    """Return the trials that count in a setting.

    They are those with this reference, and in both settings those of targets at rest, of scenarios
    that a known motion can do.

    Args:
        trials: rows of one plant, with the facts of their scenarios.
        setting: whether the path may wait.
    """
    rows = ran(trials)
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


@dataclass(frozen=True, eq=False)
class Rates:
    """The rates of success of formulations over the same cases.

    Attributes:
        contenders: a row per formulation and solver.
        rate: the rate of each, (k,); NaN where it ran no trial.
        trials: number of its trials, (k,).
        whole: whether it ran every case, (k,).
        difference: of its rate to the best one's, over the cases of both, (k,); at most 0.
        lower, upper: the paired 95 % interval of that, (k,).
        best: whether it is, or cannot be told apart from, the best of those that ran every case.
    """

    contenders: pd.DataFrame
    rate: Array
    trials: Array
    whole: Mask
    difference: Array
    lower: Array
    upper: Array
    best: Mask


def rates(trials: pd.DataFrame, done: Mask) -> Rates:
    """Compute the rates of success of every formulation, and compare each with the best.

    The intervals are those of paired differences under a bootstrap over families, scenarios and
    seeds. Oracles do not compete.

    Args:
        trials: rows that count (see `counted`).
        done: whether the robot did its job in each.
    """
    layout = TrialMatrix.of(trials)
    matrix = layout.fill(done.astype(float))
    cases = _cases(trials, layout)
    base = hierarchical_weights(cases)
    rate, ran_there = _means(matrix, base), ~np.isnan(matrix)
    whole: Mask = np.asarray(ran_there.all(axis=0))
    competes: Mask = whole & ~layout.contenders["formulation"].isin(ORACLES).to_numpy()
    difference, lower, upper = (np.full(len(rate), np.nan) for _ in range(3))
    best = np.zeros(len(rate), dtype=bool)
    if competes.any():
        first = int(np.flatnonzero(competes)[rate[competes].argmax()])
        drawn = draw_weights(list(cases["scenario_family"]), list(cases["scenario"])) * base
        differences = matrix - matrix[:, [first]]
        difference = _means(differences, base)
        lower, upper = _intervals(differences, drawn)
        best = np.asarray(competes & (upper >= 0) & (rate > 0))
    return Rates(
        layout.contenders, rate, ran_there.sum(axis=0), whole, difference, lower, upper, best
    )


def hierarchical_weights(cases: pd.DataFrame) -> Array:
    """Compute the weight of each case in the mean over `LEVELS` and the cases below, (n,)."""
    weights = np.ones(len(cases))
    above = pd.Series(0, cases.index)
    for level in LEVELS:
        inside = above.groupby([above, cases[level]], sort=False).ngroup()
        number = inside.groupby(above).transform("nunique")
        weights /= number.to_numpy()
        above = inside
    weights /= above.groupby(above).transform("size").to_numpy()
    return weights


def _cases(trials: pd.DataFrame, layout: TrialMatrix) -> pd.DataFrame:
    """Return the facts of each row of the matrix."""
    first = trials.assign(row=layout.row).drop_duplicates("row").sort_values("row")
    found: pd.DataFrame = first[list(LEVELS)].fillna("").reset_index(drop=True)
    return found


def _means(values: Array, weights: Array) -> Array:
    """Compute the weighted mean of each column over its numbers, (k,)."""
    defined = ~np.isnan(values)
    with np.errstate(invalid="ignore"):
        means: Array = (weights @ np.where(defined, values, 0.0)) / (
            weights @ defined.astype(float)
        )
    return means


def _intervals(values: Array, weights: Array) -> tuple[Array, Array]:
    """Compute the percentile intervals of the weighted means of columns, (k,) each."""
    means = _means(values, weights)
    tails = ((1 - INTERVAL_COVERAGE) / 2, (1 + INTERVAL_COVERAGE) / 2)
    lower, upper = np.nanquantile(means, tails, axis=0)
    return lower, upper
