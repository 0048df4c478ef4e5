"""The sentences of a summary, each from the rows that carry it."""

from __future__ import annotations

from collections import Counter
from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np
import pandas as pd

from dikbench.arrays import Array, Mask
from dikbench.metrics import Outcome
from dikbench.report.selection.judged import IN_WORDS
from dikbench.report.sentences.robustness import without_one
from dikbench.report.sentences.sample import cases_in_words
from dikbench.report.sentences.words import FEW, Names, listed, number, several
from dikbench.statistics.accuracy import SMALLEST_DISTANCE_M, log_distances
from dikbench.statistics.failures import ran
from dikbench.statistics.first_places import FEWEST_SCENARIOS, places, told_of, too_few
from dikbench.statistics.stability import LARGEST_DRIFT_SHARE as DRIFT
from dikbench.statistics.stability import STABLE
from dikbench.statistics.success import (
    ROUNDING,
    Contender,
    Rates,
    Setting,
    paired_means,
    rates,
    succeeded,
)
from dikbench.statistics.trial_matrix import CONTENDER

NEARER: Final = 1.05
"""Who is nearer to the path is so by more than this ratio."""

SAME_SHARE: Final = 0.01
"""Shares that differ by less than this part of the larger one are the same."""


@dataclass(frozen=True)
class Finding:
    """A sentence and what it answers.

    Attributes:
        question: in a few words.
        text: the sentence; names of formulations stand between backticks.
    """

    question: str
    text: str


@dataclass(frozen=True)
class Leaders:
    """Who is first in a situation of a setting, or may be.

    Attributes:
        contenders: the candidates that the rows do not exclude from being first, those that are
            first among them; empty where there are too few cases.
        alone: whether they are first beyond doubt, and another candidate is not.
        found: the rates of all.
        finding: the sentence.
    """

    contenders: tuple[Contender, ...]
    alone: bool
    found: Rates
    finding: Finding


def leaders(
    part: pd.DataFrame,
    setting: Setting,
    candidates: Collection[Contender],
    names: Names,
    barred: Mapping[Contender, float] | None = None,
) -> Leaders | None:
    """Say who succeeds most in a situation; None where nobody can be named.

    Args:
        part: the rows of the situation that count.
        setting: of the rows.
        candidates: who may be first (see `dependable`).
        names: how formulations are called.
        barred: who is no candidate but is named where somebody stands out and it does as well, and
            the share of all trials in which each is stopped (see `held_back`).
    """
    may_be = told_of(part, candidates)
    found = rates(part, succeeded(part), may_be)
    every = list(found.contenders.itertuples(index=False, name=None))
    rivals = np.array([name in may_be for name in every]) & found.whole
    if too_few(part) and found.rate[rivals].max(initial=0.0) > 0:
        text = (
            f"success of {cases_in_words(part)}: too few to say who is first ({FEWEST_SCENARIOS} "
            f"scenarios are asked for); the candidates have {range_of(found.rate[rivals])}."
        )
        return Leaders((), False, found, Finding(f"Too few cases where {IN_WORDS[setting]}", text))
    first, may_lead = places(part, found, rivals)
    if not first.any():
        return None
    order = sorted(np.flatnonzero(may_lead), key=lambda k: -found.rate[k])
    alone = False
    if rivals.sum() == 1:
        question = "The only candidate"
        said = _with_shares([(every[k], found.rate[k]) for k in order], names)
    elif (first == rivals).all():
        question, much = "Nobody stands out", range_of(found.rate[first])
        said = f"all {len(order)} candidates have {much}"
        said += ", not told apart" if " to " in much else ""
    else:
        alone = bool((first == may_lead).all())
        question = "First" if alone else "May be first"
        said = _with_shares([(every[k], found.rate[k]) for k in order], names)
        said += ", not told apart" if len(order) > 1 else ""
        slower = np.flatnonzero(rivals & ~may_lead & (found.upper >= 0))
        if len(slower):
            by_rate = sorted(slower, key=lambda k: -found.rate[k])
            said += f"; slower: {_with_shares([(every[k], found.rate[k]) for k in by_rate], names)}"
        said += _next(found, rivals & (found.upper < 0), every, names)
    if question != "Nobody stands out":
        said += _as_good(part, found, barred or {}, float(found.rate[first].max()), names)
    if question in {"First", "May be first"}:
        said += without_one(part, found, rivals, every, names)
    text = f"success of {cases_in_words(part)}: {said}{_pace(part, setting, may_lead, found)}."
    contenders = tuple(every[k] for k in order)
    return Leaders(contenders, alone, found, Finding(f"{question} where {IN_WORDS[setting]}", text))


def _with_shares(of: Sequence[tuple[Contender, float]], names: Names) -> str:
    """Name formulations with their rates, best first, those of the same rate together.

    After a few rates the others are counted.
    """
    groups: dict[str, list[Contender]] = {}
    for contender, rate in of:
        groups.setdefault(number(100 * rate), []).append(contender)
    told = [f"{names.of(group)} with {share} %" for share, group in groups.items()]
    if len(told) > FEW:
        left = list(groups.items())[FEW - 1 :]
        ends = f"{left[-1][0]} to {left[0][0]} %"
        told[FEW - 1 :] = [f"{sum(len(group) for _, group in left)} more with {ends}"]
    return "; ".join(told)


def _as_good(
    part: pd.DataFrame, found: Rates, barred: Mapping[Contender, float], best: float, names: Names
) -> str:
    """Name who is no candidate and succeeds as often here as the best of those who are first."""
    may_be = told_of(part, barred)
    every = found.contenders.itertuples(index=False, name=None)
    who = [
        contender
        for contender, rate, whole in zip(every, found.rate, found.whole, strict=True)
        if whole and contender in may_be and rate >= best - ROUNDING
    ]
    if not who:
        return ""
    stopped = range_of(np.array([barred[contender] for contender in who]))
    return (
        f"; as successful, but no candidate (stopped in {stopped} of all trials): {names.of(who)}"
    )


def range_of(rates: Array) -> str:
    """Say from which to which rate some go [%]."""
    low, high = number(100 * float(rates.min())), number(100 * float(rates.max()))
    return f"{high} %" if low == high else f"{low} to {high} %"


def _next(found: Rates, others: Mask, every: Sequence[Contender], names: Names) -> str:
    """Name the best of the other candidates, ties together, and how far behind they are."""
    if not others.any():
        return ""
    most = found.rate[others].max()
    who = [int(k) for k in np.flatnonzero(others & (found.rate >= most - ROUNDING))]
    low, high = number(-100 * found.upper[who].max()), number(-100 * found.lower[who].min())
    points = low if low == high else f"{low} to {high}"
    named = names.of([every[k] for k in who])
    return f"; next of the candidates is {named} with {number(100 * most)} %, {points} points less"


def _pace(part: pd.DataFrame, setting: Setting, who: Mask, found: Rates) -> str:
    """Say how much time some take where the path waits, over the cases that all of them did.

    Nothing is said where these are of too few scenarios.
    """
    if setting != "path":
        return ""
    done = part["slow_down"].where(succeeded(part)).to_numpy(dtype=float)
    matrix = found.layout.fill(done)[:, np.flatnonzero(who)]
    common: Mask = np.asarray(~np.isnan(matrix).any(axis=1))
    if found.layout.cases["scenario"][common].nunique() < FEWEST_SCENARIOS:
        return ""
    medians = np.median(matrix[common], axis=0)
    low, high = number(float(medians.min())), number(float(medians.max()))
    much = "" if high == "1" else f"{high} times "
    if low != high:
        much = f"{low} to {high} times "
    whom = "all of them" if who.sum() > 1 else "it"
    over = f"{several(int(common.sum()), 'case')} that {whom} did"
    return f". Median time over the {over}: {much}the nominal duration"


def most_accurate(part: pd.DataFrame, leading: Leaders, names: Names) -> Finding | None:
    """Say who of those that may be first is nearest to the path, in the cases that all of them did.

    Distances and ratios are geometric means over these cases, paired (see `log_distances`). None
    where they are alike, where there is one alone, or where the nearest and the next one differ by
    more than rounding in fewer than `FEWEST_SCENARIOS` scenarios.
    """
    if len(leading.contenders) < 2:
        return None
    found = leading.found
    every = list(found.contenders.itertuples(index=False, name=None))
    columns = [every.index(name) for name in leading.contenders]
    matrix = found.layout.fill(log_distances(part))[:, columns]
    common = ~np.isnan(matrix).any(axis=1)
    if not common.any():
        return None
    matrix[~common] = np.nan
    away = 1e3 * np.exp(paired_means(matrix, found)[0])
    best = int(away.argmin())
    means, lower, _ = paired_means(matrix - matrix[:, [best]], found)
    behind = np.flatnonzero((lower > 0) & (means > np.log(NEARER)))
    if not len(behind):
        return None
    second = behind[means[behind].argmin()]
    apart = np.abs(np.exp(matrix[:, second]) - np.exp(matrix[:, best])) > SMALLEST_DISTANCE_M
    differing = found.layout.cases["scenario"][apart].nunique()
    if differing < FEWEST_SCENARIOS:
        return None
    together = np.flatnonzero(means < means[second])
    low, high = number(float(away[together].min())), number(float(away[together].max()))
    floor = number(1e3 * SMALLEST_DISTANCE_M)
    text = (
        f"of these {names.of([leading.contenders[k] for k in together])}, "
        f"{low if low == high else f'{low} to {high}'} mm from the path at most; next is "
        f"{names.of([leading.contenders[second]])}, {number(float(np.exp(means[second])))} times "
        f"as far as the nearest (geometric means, paired over the {int(common.sum())} cases that "
        f"all of them did, in {differing} scenarios of which they are more than {floor} mm apart; "
        f"less than {floor} mm counts as {floor} mm, angles with 0.2 m)"
    )
    return Finding("Most accurate", f"{text}.")


def broke_off(rows: pd.DataFrame, names: Names) -> Finding | None:
    """Name everybody that had trials which did not run or diverged; None where all ran."""
    rows = ran(rows)
    failed = rows[rows["outcome"].isin([Outcome.DID_NOT_RUN.value, Outcome.DIVERGED.value])]
    if failed.empty:
        return None
    totals = rows.groupby(CONTENDER, sort=False).size()
    said = []
    for (formulation, solver), part in failed.groupby(CONTENDER):
        contender = (str(formulation), str(solver))
        counts = sorted(part["status"].value_counts().items(), key=lambda pair: (-pair[1], pair[0]))
        reasons = listed([f"{count} {status}" for status, count in counts])
        total = totals[contender]
        text = f"{names.of([contender])} in {len(part)} of {total} trials ({reasons})"
        said.append((-len(part) / total, text))
    return Finding("Broke off", f"{listed([text for _, text in sorted(said)])}.")


def unanswered(rows: pd.DataFrame, names: Names) -> Finding | None:
    """Name who had no answer in the largest share of a run's steps; None where all had."""
    shares = ran(rows)[["infeasible_share", "solver_failed_share"]].sum(axis=1)
    worst = ran(rows).assign(share=shares).groupby(CONTENDER, sort=False)["share"].max()
    if worst.empty or not worst.max() > 0:
        return None
    most = list(worst[worst >= (1 - SAME_SHARE) * worst.max()].index)
    return Finding(
        "No answer",
        f"{names.of(most)} posed programs without a feasible point, or got no answer, in up to "
        f"{number(100 * worst.max())} % of a run's steps, and braked instead, in the trials that "
        "count.",
    )


def first_most_often(
    firsts: Sequence[tuple[Setting, tuple[Contender, ...]]], names: Names
) -> list[Finding]:
    """Say for each setting who is first, alone or tied, in the most situations.

    Args:
        firsts: who is first in each situation in which somebody stands out.
        names: how they are called.
    """
    found = []
    for setting, where in IN_WORDS.items():
        of_setting = [contenders for each, contenders in firsts if each == setting]
        counts = Counter(contender for contenders in of_setting for contender in contenders)
        if len(of_setting) < 2:
            continue
        most = max(counts.values())
        who = [contender for contender, count in counts.items() if count == most]
        text = (
            f"{names.of(who)}, alone or tied, in {most} of the {len(of_setting)} situations in "
            "which somebody stands out"
        )
        found.append(Finding(f"First most often where {where}", f"{text}."))
    return found


def fastest(rows: pd.DataFrame, among: Collection[Contender], names: Names) -> Finding | None:
    """Say whose call takes the least time of the candidates; None of fewer than two.

    Args:
        rows: trials, of any plant.
        among: the candidates.
        names: how they are called.
    """
    cells = rows.drop_duplicates([*CONTENDER, "scenario"])
    cells = cells[cells["formulation_time_median_us"].notna()]
    keys = pd.MultiIndex.from_frame(cells[CONTENDER])
    cells = cells[keys.isin(list(among))] if among else cells[:0]
    timed = cells.groupby(CONTENDER, sort=False)["scenario"].nunique()
    medians = cells.groupby(CONTENDER, sort=False)["formulation_time_median_us"].median()
    medians = medians[timed.eq(timed.max())].sort_values(kind="stable")
    if len(medians) < 2:
        return None
    alike = list(medians[medians <= (1 + DRIFT) * medians.iloc[0]].index)
    text = f"{names.of(alike)}, {number(medians.iloc[0] / 1e3)} ms a call"
    if len(alike) > 1:
        text += f" (not told apart: a stable time may drift by {number(100 * DRIFT)} %)"
    if len(medians) > len(alike):
        slowest = number(medians.iloc[-1] / medians.iloc[0])
        text += f"; the slowest, {names.of([medians.index[-1]])}, takes {slowest} times as long"
    text += f" (medians over {several(int(timed.max()), 'scenario')})"
    unstable = int(cells["timing_stability"].ne(STABLE).sum())
    if unstable:
        text += f"; of {len(cells)} timed cells {unstable} cannot be trusted"
    return Finding("Fastest of the candidates", f"{text}.")
