"""The sentences of a summary, each from the rows that carry it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np
import pandas as pd

from dikbench.arrays import Mask
from dikbench.metrics import Outcome
from dikbench.report.selection.judged import IN_WORDS
from dikbench.report.sentences.words import (
    Contender,
    Names,
    listed,
    millimetres,
    number,
    several,
)
from dikbench.statistics.failures import ran
from dikbench.statistics.first_places import first_places
from dikbench.statistics.stability import LARGEST_DRIFT_SHARE as DRIFT
from dikbench.statistics.stability import STABLE
from dikbench.statistics.success import Rates, Setting, paired_means, rates, succeeded
from dikbench.statistics.trial_matrix import CONTENDER

SMALLEST_DISTANCE_M: Final = 1e-5
"""Distances from the path below this are equally small: what is left is the sampling."""

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
        contenders: the formulations that are first.
        found: the rates of all.
        finding: the sentence.
    """

    contenders: tuple[Contender, ...]
    found: Rates
    finding: Finding


def leaders(
    part: pd.DataFrame, setting: Setting, candidates: set[Contender], names: Names
) -> Leaders | None:
    """Say who succeeds most in a situation; None where nobody can be named.

    Args:
        part: the rows of the situation that count.
        setting: of the rows.
        candidates: who may be named (see `dependable`).
        names: how formulations are called.
    """
    found = rates(part, succeeded(part))
    first = first_places(part, found, candidates)
    if not first.any():
        return None
    all_names = list(found.contenders.itertuples(index=False, name=None))
    order = sorted(np.flatnonzero(first), key=lambda k: -found.rate[k])
    groups: dict[str, list[Contender]] = {}
    for k in order:
        groups.setdefault(number(100 * found.rate[k]), []).append(all_names[k])
    said = [f"{names.of(group)} with {share} %" for share, group in groups.items()]
    text = f"success of {_sample(part)}: {'; '.join(said)}"
    if len(order) > 1:
        text += ", not told apart"
    text += _next(found, first, candidates, names) + _pace(part, setting, first, found)
    contenders = tuple(all_names[k] for k in order)
    return Leaders(contenders, found, Finding(f"First where {IN_WORDS[setting]}", f"{text}."))


def _sample(part: pd.DataFrame) -> str:
    """Say over how many cases rates are."""
    cases = part[["scenario", "seed"]].drop_duplicates()
    return (
        f"{several(len(cases), 'case')} ({several(cases['scenario'].nunique(), 'scenario')}, "
        f"{several(part['robot'].nunique(), 'robot')})"
    )


def _next(found: Rates, first: Mask, candidates: set[Contender], names: Names) -> str:
    """Name the best of the candidates that can be told apart from the first."""
    all_names = list(found.contenders.itertuples(index=False, name=None))
    others = [
        k
        for k, name in enumerate(all_names)
        if name in candidates and not found.best[k] and found.upper[k] < 0
    ]
    if not others or not first.any():
        return ""
    k = max(others, key=lambda k: float(found.rate[k]))
    return (
        f"; next is {names.of([all_names[k]])} with {number(100 * found.rate[k])} %, "
        f"{number(-100 * found.upper[k])} to {number(-100 * found.lower[k])} points less"
    )


def _pace(part: pd.DataFrame, setting: Setting, first: Mask, found: Rates) -> str:
    """Say how much time they take where the path waits."""
    if setting != "path":
        return ""
    done = part["slow_down"].where(succeeded(part)).to_numpy(dtype=float)
    values = found.layout.fill(done)[:, np.flatnonzero(first)]
    if np.isnan(values).all():
        return ""
    medians = np.nanmedian(values, axis=0)
    low, high = number(float(medians.min())), number(float(medians.max()))
    much = low if low == high else f"{low} to {high}"
    return f". They take {much} times the nominal duration (medians of what they did)"


def most_accurate(part: pd.DataFrame, leading: Leaders, names: Names) -> Finding | None:
    """Say who of the first is nearest to the path, in trials that all of them did.

    None where they are alike, or where there is one alone.
    """
    if len(leading.contenders) < 2 or part["judged_by_path"].eq(0).all():
        return None
    found = leading.found
    all_names = list(found.contenders.itertuples(index=False, name=None))
    columns = [all_names.index(name) for name in leading.contenders]
    away = part["contour_error_6d_max_m"].clip(lower=SMALLEST_DISTANCE_M).where(succeeded(part))
    matrix = found.layout.fill(np.log(away.to_numpy(dtype=float)))[:, columns]
    common = ~np.isnan(matrix).any(axis=1)
    if common.sum() < 2:
        return None
    matrix[~common] = np.nan
    best = int(np.nanmean(matrix, axis=0).argmin())
    means, lower, _ = paired_means(matrix - matrix[:, [best]], found)
    together = [k for k in range(len(columns)) if not lower[k] > 0]
    behind = [k for k in range(len(columns)) if lower[k] > 0]
    if not behind:
        return None
    second = min(behind, key=lambda k: float(means[k]))
    value = float(np.exp(np.nanmedian(matrix[:, best])))
    text = (
        f"of these {names.of([leading.contenders[k] for k in together])}, "
        f"{millimetres(value)} from the path at most (median of "
        f"{several(int(common.sum()), 'case')} that all of them did; angles count with 0.2 m); "
        f"next is "
        f"{names.of([leading.contenders[second]])}, {number(float(np.exp(means[second])))} times "
        "as far"
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
        f"{names.of(most)} had no answer in up to {number(100 * worst.max())} % of a run's steps, "
        "and braked instead.",
    )


def first_most_often(
    firsts: Sequence[tuple[Setting, tuple[Contender, ...]]], names: Names
) -> list[Finding]:
    """Say for each setting who is first, alone or tied, in the most situations."""
    found = []
    for setting, where in IN_WORDS.items():
        of_setting = [contenders for each, contenders in firsts if each == setting]
        counts: dict[Contender, int] = {}
        for contenders in of_setting:
            for contender in contenders:
                counts[contender] = counts.get(contender, 0) + 1
        if not counts:
            continue
        most = max(counts.values())
        who = [contender for contender, count in counts.items() if count == most]
        of = several(len(of_setting), "situation")
        text = f"{names.of(who)}, alone or tied, in {most} of {of} in which somebody can be named"
        found.append(Finding(f"First most often where {where}", f"{text}."))
    return found


def fastest(rows: pd.DataFrame, among: Sequence[Contender], names: Names) -> Finding | None:
    """Say whose call takes the least time of those who are first somewhere; None without times.

    Args:
        rows: trials, of any plant.
        among: who is first in a situation.
        names: how they are called.
    """
    cells = rows.drop_duplicates([*CONTENDER, "scenario"])
    cells = cells[cells["formulation_time_median_us"].notna()]
    keys = pd.MultiIndex.from_frame(cells[CONTENDER])
    cells = cells[keys.isin(list(among))]
    if cells.empty:
        return None
    timed = cells.groupby(CONTENDER, sort=False)["scenario"].nunique()
    medians = cells.groupby(CONTENDER, sort=False)["formulation_time_median_us"].median()
    medians = medians[timed.eq(timed.max())].sort_values(kind="stable")
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
        text += f"; {unstable} of {len(cells)} timed cells are not stable"
    return Finding("Fastest of those who are first somewhere", f"{text}.")
