"""One formulation against others within a results folder: paired differences and their tests."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from typing import Final

import numpy as np
import pandas as pd

from dikbench.arrays import Array
from dikbench.errors import DikbenchError, unknown
from dikbench.report.comparison.differences import ROUNDING
from dikbench.report.selection.judged import (
    CONSTRAINED,
    DEFINITIONS,
    SETTINGS,
    judged_rows,
)
from dikbench.scenario.oracle import ORACLES
from dikbench.statistics.accuracy import log_distances
from dikbench.statistics.failures import ran
from dikbench.statistics.paired_tests import holm, mcnemar, odds_ratio, rank_biserial
from dikbench.statistics.success import FACTS, Setting, paired_means, rates, succeeded
from dikbench.statistics.trial_matrix import CASE, CONTENDER

ALL: Final = "all situations"
KINEMATIC: Final = "kinematic situations"
OVERALL: Final = (ALL, KINEMATIC)

Contender = tuple[str, str]
Interval = tuple[float, float]
NO_INTERVAL: Final[Interval] = (np.nan, np.nan)


@dataclass(frozen=True)
class Pair:
    """How A does against B in the cases of a setting and situation that both ran.

    Attributes:
        setting: whether the path may wait.
        situation: one of `DEFINITIONS`, or of `OVERALL`.
        a, b: names of formulations, with their solvers.
        cases: number of scenarios and seeds that both ran and that count.
        scenarios: number of scenarios among them.
        rate_a, rate_b: their rates of success over them (hierarchical means).
        difference: rate_a - rate_b.
        difference_interval: its 95 % interval, by a bootstrap over families, robots, scenarios and
            seeds; NaN where all cases agree.
        only_a, only_b: scenarios in which A succeeds with more seeds than B, and with fewer.
        odds_ratio: only_a / only_b.
        p: exact McNemar p value of them. Seeds of a scenario are no independent trials.
        p_holm: the same by Holm's correction, over all of `OVERALL` or all situations that are
            compared.
        both: number of cases in which both succeed.
        error_ratio: geometric mean over those with a path of A's error over B's (see
            `log_distances`).
        error_interval: its 95 % interval.
        rank_biserial: matched-pairs rank-biserial correlation of the same; positive where A is the
            more accurate.
        duration_ratio: geometric mean over them of A's slow-down over B's.
        duration_interval: its 95 % interval.
        unseen: which of the two does not see what limits it here, in words; the rest is then empty.
    """

    setting: Setting
    situation: str
    a: str
    b: str
    cases: int = 0
    scenarios: int = 0
    rate_a: float = np.nan
    rate_b: float = np.nan
    difference: float = np.nan
    difference_interval: Interval = NO_INTERVAL
    only_a: int = 0
    only_b: int = 0
    odds_ratio: float = np.nan
    p: float = np.nan
    p_holm: float = np.nan
    both: int = 0
    error_ratio: float = np.nan
    error_interval: Interval = NO_INTERVAL
    rank_biserial: float = np.nan
    duration_ratio: float = np.nan
    duration_interval: Interval = NO_INTERVAL
    unseen: str = ""


def compare_formulations(trials: pd.DataFrame, names: Sequence[str]) -> list[Pair]:
    """Compare a formulation with another, or with all others that are no oracles.

    Args:
        trials: the rows of trials.csv.
        names: one or two formulations, as they stand there, " with " their solver where they ran
            with several.

    Returns:
        The pairs by setting and situation, those over all situations first; of each A's largest
        gain in success first.

    Raises:
        DikbenchError: if there is no such formulation, no case that counts and that both ran, or
            the rows have no outcomes.
    """
    if not {"outcome", *FACTS} <= {*trials} or not trials["outcome"].notna().any():
        raise DikbenchError(
            "the trials have no outcomes: `dikbench recompute` adds them from traces, else run "
            "the study again"
        )
    first, *others = (_contender(trials, name) for name in names)
    if not others:
        known = ran(trials)[CONTENDER].drop_duplicates().itertuples(index=False, name=None)
        others = [one for one in known if one != first and one[0] not in ORACLES]
    if first in others or not others:
        raise DikbenchError(f"formulation {label(first)!r} has no other to be compared with")
    pairs = [pair for setting in SETTINGS for pair in _of_setting(trials, setting, first, others)]
    if not pairs:
        raise DikbenchError(
            f"formulation {label(first)!r} ran no case that counts with one that it is compared "
            "with: a case counts where a motion is known that can do it"
        )
    return _corrected(pairs)


def label(contender: Contender) -> str:
    """Name a formulation with its solver, where it has one."""
    formulation, solver = contender
    return formulation if solver == "none" else f"{formulation} with {solver}"


def _contender(trials: pd.DataFrame, name: str) -> Contender:
    """Find the formulation and solver that a name stands for."""
    known: list[Contender] = list(
        trials[CONTENDER].drop_duplicates().itertuples(index=False, name=None)
    )
    of_formulation = [one for one in known if one[0] == name]
    if len(of_formulation) == 1:
        return of_formulation[0]
    labels = {label(one): one for one in known}
    if name in labels:
        return labels[name]
    if of_formulation:
        raise DikbenchError(
            f"formulation {name!r} ran with several solvers: name one, as in "
            f"{label(of_formulation[0])!r}; valid: {', '.join(one for _, one in of_formulation)}"
        )
    raise unknown("formulation", name, labels)


def _of_setting(
    trials: pd.DataFrame, setting: Setting, first: Contender, others: Sequence[Contender]
) -> Iterator[Pair]:
    """Compare in a setting, over all situations and in each."""
    rows = judged_rows(trials, setting)
    present = set(rows["situation"])
    parts = {ALL: rows}
    if CONSTRAINED in present and len(present) > 1:
        parts[KINEMATIC] = rows[rows["situation"].ne(CONSTRAINED)]
    parts |= {name: rows[rows["situation"].eq(name)] for name in DEFINITIONS if name in present}
    for situation, part in parts.items():
        pairs = [_pair(part, setting, situation, first, other) for other in others]
        yield from sorted((p for p in pairs if p), key=lambda p: -np.nan_to_num(p.difference))


def _pair(
    rows: pd.DataFrame, setting: Setting, situation: str, first: Contender, second: Contender
) -> Pair | None:
    """Compare two over the cases that both ran; None where there is none."""
    of_both = [
        rows[rows["formulation"].eq(formulation) & rows["solver"].eq(solver)]
        for formulation, solver in (first, second)
    ]
    keys = [pd.MultiIndex.from_frame(part[CASE]) for part in of_both]
    a, b = (
        part[key.isin(other)]
        for part, key, other in zip(of_both, keys, reversed(keys), strict=True)
    )
    if a.empty:
        return None
    pair = Pair(setting, situation, label(first), label(second))
    if situation == CONSTRAINED:
        blind = [
            label(c)
            for c, part in ((first, a), (second, b))
            if part["sees_constraints"].eq(0).any()
        ]
        if blind:
            return replace(pair, unseen=f"{' and '.join(blind)} not told of them")
    both = pd.concat([a, b], ignore_index=True)
    found = rates(both, succeeded(both))
    done = found.layout.fill(succeeded(both).astype(float))
    ahead = _ahead(found.layout.cases["scenario"], done[:, 0] - done[:, 1])
    only_a, only_b = int((ahead > 0).sum()), int((ahead < 0).sum())

    def paired(values: Array) -> tuple[float, Interval]:
        """Compute the mean of differences, (n,), and its interval."""
        known = values[~np.isnan(values)]
        if not len(known):
            return np.nan, NO_INTERVAL
        means, lower, upper = paired_means(values[:, None], found)
        varies = np.unique(known).size > 1
        interval = (float(lower[0]), float(upper[0])) if varies else NO_INTERVAL
        return float(means[0]), interval

    def log_ratios(logarithms: Array) -> Array:
        """Compute ln(A / B) of each case, NaN where one of the two has none."""
        apart = np.subtract(*found.layout.fill(logarithms).T)
        return np.where(np.abs(apart) <= ROUNDING, 0.0, apart)

    difference, difference_interval = paired(done[:, 0] - done[:, 1])
    slow_down = both["slow_down"].where(succeeded(both) & np.isfinite(both["slow_down"]))
    errors = log_ratios(log_distances(both))
    durations = log_ratios(np.log(slow_down.to_numpy(dtype=float)))
    error, error_interval = paired(errors)
    duration, duration_interval = paired(durations)
    return replace(
        pair,
        cases=len(done),
        scenarios=len(ahead),
        rate_a=float(found.rate[0]),
        rate_b=float(found.rate[1]),
        difference=difference,
        difference_interval=difference_interval,
        only_a=only_a,
        only_b=only_b,
        odds_ratio=odds_ratio(only_a, only_b),
        p=mcnemar(only_a, only_b),
        both=int((done == 1).all(axis=1).sum()),
        error_ratio=float(np.exp(error)),
        error_interval=_exp(error_interval),
        rank_biserial=rank_biserial(-errors[~np.isnan(errors)]),
        duration_ratio=float(np.exp(duration)),
        duration_interval=_exp(duration_interval),
    )


def _ahead(scenarios: pd.Series, differences: Array) -> Array:
    """Sum the differences of the seeds of each scenario, (scenarios,)."""
    sums = pd.Series(differences).groupby(scenarios.to_numpy(), sort=False).sum()
    return np.asarray(sums, dtype=float)


def _exp(interval: Interval) -> Interval:
    low, high = np.exp(interval)
    return float(low), float(high)


def _corrected(pairs: Sequence[Pair]) -> list[Pair]:
    """Correct the p values of the pairs over all situations, and those of each situation."""
    found = list(pairs)
    for overall in (True, False):
        places = [
            place
            for place, pair in enumerate(pairs)
            if (pair.situation in OVERALL) == overall and not np.isnan(pair.p)
        ]
        corrected = holm(np.array([pairs[place].p for place in places]))
        for place, p in zip(places, corrected, strict=True):
            found[place] = replace(pairs[place], p_holm=float(p))
    return found
