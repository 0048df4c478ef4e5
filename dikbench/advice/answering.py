"""The answer to each need: what is recommended, on what evidence, and what is as good."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import pandas as pd

from dikbench.advice.needs import Need
from dikbench.statistics.accuracy import log_distances
from dikbench.statistics.first_places import FEWEST_SCENARIOS, dependable, too_few
from dikbench.statistics.success import Contender, Rates, Setting, counted, rates, weighted_means


@dataclass(frozen=True)
class Standing:
    """How a formulation did with regard to a need.

    Attributes:
        formulation, solver: their selectors.
        rate: its rate, 0 to 1, over families, then cases.
        failed, runs: how many of its runs did not meet the need, and how many there were.
        distance: geometric mean of its largest distances from the path where it succeeded [m]; NaN
            where it never did.
        slowest: largest duration over the nominal one where it succeeded and the path may wait.
    """

    formulation: str
    solver: str
    rate: float
    failed: int
    runs: int
    distance: float
    slowest: float

    @property
    def name(self) -> str:
        """Name both."""
        return f"`{self.formulation}`" + (f" with `{self.solver}`" if self.solver != "none" else "")


@dataclass(frozen=True)
class Answer:
    """The answer to a need.

    Attributes:
        need: the need.
        first: what is recommended; None where nothing can be.
        tied: what cannot be told apart from it.
        left_behind: what ran fewer cases, and on these could not be told apart from it either.
        others: the rest, the best first.
        cases: number of cases.
        runner_up: the best of the rest that may be recommended; None where none of them may.
        reason: why nothing is recommended; else empty.
    """

    need: Need
    first: Standing | None
    tied: tuple[Standing, ...]
    left_behind: tuple[Standing, ...]
    others: tuple[Standing, ...]
    cases: int
    reason: str = ""
    runner_up: Standing | None = None


def answer(need: Need, trials: pd.DataFrame) -> Answer:
    """Answer a need from trials in which every formulation ran every case.

    A formulation may be recommended only if it is dependable (see
    `dikbench.statistics.first_places`): who stands still breaks no limit, and who ignores limits is
    accurate where none is near. Of those that the sample does not tell apart from the best by the
    paired interval, the one with the largest rate is recommended, then the one nearest to the path;
    the others are named as tied.

    Args:
        need: the need.
        trials: rows of the ideal plant.
    """
    part = counted(trials, need.setting)
    settings: tuple[Setting, ...] = ("path", "time")
    whole = pd.concat([counted(trials, each) for each in settings]).drop_duplicates(
        ["formulation", "solver", "scenario", "seed", "reference"]
    )
    if part.empty or too_few(part):
        number = 0 if part.empty else part["scenario"].nunique()
        reason = (
            f"{number} cases that something can do are too few to say (at least "
            f"{FEWEST_SCENARIOS}); valid: a larger --budget, or a frame that more families fit"
        )
        return Answer(need, None, (), (), (), number, reason)
    may = dependable(part, whole)
    found = rates(part, need.met(part), may)
    standings = _standings(part, need, found)
    first, tied = _first(found, may, standings)
    if first is None:
        reason = (
            "no formulation that was tried is dependable here: each breaks limits in more than "
            "5 % of the runs or does less than half of what the best does"
            if not may
            else "nothing that was tried met it once"
        )
        order = sorted(standings.values(), key=lambda each: -each.rate)
        return Answer(need, None, (), (), tuple(order), len(found.layout.cases), reason)
    behind, may_by_few = _left_behind(part, whole, found)
    rest = [e for pair, e in standings.items() if pair not in {first, *tied, *behind}]
    order = sorted(rest, key=lambda each: (-each.rate, each.distance))
    # Who stands still keeps every limit, and is nobody's runner-up.
    up = next((each for each in order if _pair(each) in may | may_by_few), None)
    return Answer(
        need,
        standings[first],
        tuple(standings[pair] for pair in tied),
        tuple(standings[pair] for pair in behind),
        tuple(order),
        len(found.layout.cases),
        runner_up=up,
    )


def _pair(standing: Standing) -> Contender:
    return standing.formulation, standing.solver


def _first(
    found: Rates, may: set[Contender], standings: dict[Contender, Standing]
) -> tuple[Contender | None, list[Contender]]:
    """Choose who is recommended, and who is tied with it."""
    pairs = list(found.contenders.itertuples(index=False, name=None))
    best = [pair for pair, is_best in zip(pairs, found.best, strict=True) if is_best]
    if not best:
        return None, []

    def order(pair: Contender) -> tuple[float, float, str]:
        own = standings[pair]
        return -round(own.rate, 9), float(np.nan_to_num(own.distance, nan=np.inf)), pair[0]

    first = min(best, key=order)
    tied = [
        pair
        for pair, upper in zip(pairs, found.upper, strict=True)
        if pair != first and pair in may and upper >= 0
    ]
    return first, sorted(tied, key=order)


def _left_behind(
    part: pd.DataFrame, whole: pd.DataFrame, found: Rates
) -> tuple[list[Contender], set[Contender]]:
    """Find who ran fewer cases, would be dependable by these, and is not told apart by them.

    Returns:
        Them, and who would be dependable by the cases that everybody ran, told apart or not.
    """
    pairs = list(found.contenders.itertuples(index=False, name=None))
    ran = ~np.isnan(found.layout.fill(np.zeros(len(part))))
    common = np.asarray(ran.all(axis=1))
    first = part[common[found.layout.row]]
    if found.whole.all() or first.empty:
        return [], set()
    cells = set(zip(first["scenario"], first["seed"], strict=True))
    own = [cell in cells for cell in zip(whole["scenario"], whole["seed"], strict=True)]
    may = dependable(first, whole[own])
    behind = [
        pair
        for pair, is_whole, upper in zip(pairs, found.whole, found.upper, strict=True)
        if not is_whole and upper >= 0 and pair in may
    ]
    return behind, may - {
        pair for pair, is_whole in zip(pairs, found.whole, strict=True) if is_whole
    }


def _standings(part: pd.DataFrame, need: Need, found: Rates) -> dict[Contender, Standing]:
    """Say how each formulation did."""
    met = need.met(part)
    distances = weighted_means(found.layout.fill(log_distances(part)), found.base)
    standings = {}
    names = list(zip(part["formulation"], part["solver"], strict=True))
    for number, pair in enumerate(found.contenders.itertuples(index=False, name=None)):
        own = np.array([name == pair for name in names])
        slow = part["slow_down"].to_numpy(dtype=float)[own & met]
        slow = slow[np.isfinite(slow)]
        standings[pair] = Standing(
            formulation=pair[0],
            solver=pair[1],
            rate=float(found.rate[number]),
            failed=int((own & ~met).sum()),
            runs=int(own.sum()),
            distance=float(np.exp(distances[number])),
            slowest=float(slow.max()) if len(slow) else float("nan"),
        )
    return standings


def answers(needs: Sequence[Need], trials: pd.DataFrame) -> list[Answer]:
    """Answer each need."""
    return [answer(need, trials) for need in needs]
