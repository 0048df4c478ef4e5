"""The sentences of a summary, each from the rows that carry it."""

from __future__ import annotations

from collections import Counter
from collections.abc import Collection, Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np
import pandas as pd

from dikbench.arrays import Array, Mask
from dikbench.metrics import Outcome
from dikbench.report.selection.judged import IN_WORDS
from dikbench.report.sentences.words import (
    Names,
    listed,
    number,
    several,
)
from dikbench.statistics.accuracy import SMALLEST_DISTANCE_M, log_distances
from dikbench.statistics.failures import ran
from dikbench.statistics.first_places import FEWEST_SCENARIOS, first_places, told_of, too_few
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
    """Who is first in a situation of a setting.

    Attributes:
        contenders: the formulations that are first; empty where there are too few cases.
        alone: whether somebody else that may be first is not: else nobody stands out.
        found: the rates of all.
        finding: the sentence.
    """

    contenders: tuple[Contender, ...]
    alone: bool
    found: Rates
    finding: Finding


def leaders(
    part: pd.DataFrame, setting: Setting, candidates: Collection[Contender], names: Names
) -> Leaders | None:
    """Say who succeeds most in a situation; None where nobody can be named.

    Args:
        part: the rows of the situation that count.
        setting: of the rows.
        candidates: who may be named (see `dependable`).
        names: how formulations are called.
    """
    may_be = told_of(part, candidates)
    found = rates(part, succeeded(part), may_be)
    every = list(found.contenders.itertuples(index=False, name=None))
    rivals = np.array([name in may_be for name in every]) & found.whole
    if too_few(part) and found.rate[rivals].max(initial=0.0) > 0:
        text = (
            f"success of {_sample(part)}: too few to say who is first ({FEWEST_SCENARIOS} "
            f"scenarios are asked for); the candidates have {_range(found.rate[rivals])}."
        )
        return Leaders((), False, found, Finding(f"Too few cases where {IN_WORDS[setting]}", text))
    first = first_places(part, found)
    if not first.any():
        return None
    alone = rivals.sum() == 1 or bool((rivals & ~first).any())
    order = sorted(np.flatnonzero(first), key=lambda k: -found.rate[k])
    if alone:
        question = f"First where {IN_WORDS[setting]}"
        said = _with_shares([(every[k], found.rate[k]) for k in order], names)
        said += ", not told apart" if len(order) > 1 else ""
        said += _next(found, rivals & ~found.best, every, names)
    else:
        question = f"Nobody stands out where {IN_WORDS[setting]}"
        much = _range(found.rate[first])
        said = f"all {len(order)} that may be first have {much}"
        said += ", not told apart" if " to " in much else ""
    text = f"success of {_sample(part)}: {said}{_pace(part, setting, first, found)}."
    contenders = tuple(every[k] for k in order)
    return Leaders(contenders, alone, found, Finding(question, text))


def _with_shares(of: Sequence[tuple[Contender, float]], names: Names) -> str:
    """Name formulations with their rates, those of the same rate together."""
    groups: dict[str, list[Contender]] = {}
    for contender, rate in of:
        groups.setdefault(number(100 * rate), []).append(contender)
    return "; ".join(f"{names.of(group)} with {share} %" for share, group in groups.items())


def _sample(part: pd.DataFrame) -> str:
    """Say over how many cases rates are."""
    cases = part[["scenario", "seed"]].drop_duplicates()
    return (
        f"{several(len(cases), 'case')} ({several(cases['scenario'].nunique(), 'scenario')}, "
        f"{several(part['robot'].nunique(), 'robot')})"
    )


def _range(rates: Array) -> str:
    """Say from which to which rate some go [%]."""
    low, high = number(100 * float(rates.min())), number(100 * float(rates.max()))
    return f"{high} %" if low == high else f"{low} to {high} %"


def _next(found: Rates, others: Mask, every: Sequence[Contender], names: Names) -> str:
    """Name the best of the others, ties together, and by how much they are behind the best."""
    if not others.any():
        return ""
    most = found.rate[others].max()
    who = [int(k) for k in np.flatnonzero(others & (found.rate >= most - ROUNDING))]
    low, high = number(-100 * found.upper[who].max()), number(-100 * found.lower[who].min())
    points = low if low == high else f"{low} to {high}"
    named = names.of([every[k] for k in who])
    return f"; next is {named} with {number(100 * most)} %, {points} points less"


def _pace(part: pd.DataFrame, setting: Setting, first: Mask, found: Rates) -> str:
    """Say how much time those who are first take where the path waits."""
    if setting != "path":
        return ""
    done = part["slow_down"].where(succeeded(part)).to_numpy(dtype=float)
    columns = found.layout.fill(done)[:, np.flatnonzero(first)].T
    medians = [float(np.nanmedian(column)) for column in columns if not np.isnan(column).all()]
    if not medians:
        return ""
    low, high = number(min(medians)), number(max(medians))
    much = "" if high == "1" else f"{high} times "
    if low != high:
        much = f"{low} to {high} times "
    return f". Median time of what was done: {much}the nominal duration"


def most_accurate(part: pd.DataFrame, leading: Leaders, names: Names) -> Finding | None:
    """Say who of the first is nearest to the path, in the cases that all of them did.

    Distances and ratios are geometric means over these cases, paired (see `log_distances`). None
    where they are alike, or where there is one alone.
    """
    if len(leading.contenders) < 2:
        return None
    found = leading.found
    every = list(found.contenders.itertuples(index=False, name=None))
    columns = [every.index(name) for name in leading.contenders]
    matrix = found.layout.fill(log_distances(part))[:, columns]
    common = ~np.isnan(matrix).any(axis=1)
    if common.sum() < 2:
        return None
    matrix[~common] = np.nan
    away = 1e3 * np.exp(paired_means(matrix, found)[0])
    best = int(away.argmin())
    means, lower, _ = paired_means(matrix - matrix[:, [best]], found)
    behind = np.flatnonzero((lower > 0) & (means > np.log(NEARER)))
    if not len(behind):
        return None
    second = behind[means[behind].argmin()]
    together = np.flatnonzero(means < means[second])
    low, high = number(float(away[together].min())), number(float(away[together].max()))
    floor = number(1e3 * SMALLEST_DISTANCE_M)
    text = (
        f"of these {names.of([leading.contenders[k] for k in together])}, "
        f"{low if low == high else f'{low} to {high}'} mm from the path at most; next is "
        f"{names.of([leading.contenders[second]])}, {number(float(np.exp(means[second])))} times "
        f"as far as the nearest (geometric means, paired over the {int(common.sum())} cases that "
        f"all of the first did; less than {floor} mm counts as {floor} mm, angles with 0.2 m)"
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
    for (formulation, solver), part in failed.groupby(CONTENDER, sort=False):
        contender = (str(formulation), str(solver))
        counts = part["status"].value_counts().items()
        reasons = listed([f"{count} {status}" for status, count in counts])
        total = totals[contender]
        said.append(f"{names.of([contender])} in {len(part)} of {total} trials ({reasons})")
    return Finding("Broke off", f"{listed(said)}.")


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
    """Say whose call takes the least time of those that may be first; None of fewer than two.

    Args:
        rows: trials, of any plant.
        among: who may be first.
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
    return Finding("Fastest of those that may be first", f"{text}.")
