"""Formulations tried on an arm's cases within a budget of time."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from time import monotonic
from typing import Any, Final

import pandas as pd

from dikbench.advice.cases import Cases
from dikbench.advice.contender import Contender, contender
from dikbench.advice.evaluating import Evaluate
from dikbench.advice.needs import Need
from dikbench.plugins.drawing import Cell
from dikbench.plugins.tuned import file_for, key_of, read_tuned
from dikbench.results.selected import with_selected
from dikbench.run.trial_row import TrialRow
from dikbench.selector import Selector, parse_selector
from dikbench.statistics.first_places import FEWEST_SCENARIOS
from dikbench.statistics.success import counted, rates, with_facts
from dikbench.study.trial import Trial

CANDIDATES: Final = (
    "pinv",
    "pinv[after=clip]",
    "pinv[after=scale]",
    "dls",
    "dls-variable",
    "jparse",
    "condition-governor",
    "sns",
    "sns-optimal",
    "qp",
    "lp-alpha",
    "alpha-two-stage",
    "drake",
    "hqp",
    "pink-qp",
)
"""What is tried: of each idea the law that stands for it."""

FIRST_PART: Final = 0.35
"""Share of the budget in which all are tried ..."""

LEAST_OF_BOTH: Final = 0.5
"""... and the least in which cases are tried at all."""

LONGEST_CASE: Final = 0.1
"""A family of which a case takes more than this share of the budget ..."""

SLOWER: Final = 2.0
"""... and so many times what cases took before has no other one."""

TRIALS_AT_ONCE: Final = 8
"""So many are begun before it is seen whether time is left."""

FEWEST_CASES: Final = FEWEST_SCENARIOS + 3
LATEST: Final = 0.75
"""Until this share of the budget cases are tried where there are fewer, and none at all later."""

FINALISTS: Final = 6
"""So many go on to the second half of the cases."""

IDEAL: Final = Selector("ideal")
DISTURBED: Final = parse_selector("ideal[noise=1e-4,delay=2]")
"""The plant that measures with noise and acts late, on which finalists run in addition."""

REFERENCES: Final = ("path", "time")


@dataclass
class Clock:
    """The time that is left of a budget.

    Attributes:
        budget: [s].
        start: of the clock [s], by `time.monotonic`.
    """

    budget: float
    start: float = field(default_factory=monotonic)

    @property
    def spent(self) -> float:
        """The share of the budget that is spent."""
        return (monotonic() - self.start) / self.budget

    def left_until(self, share: float) -> float:
        """The time [s] until a share of the budget is spent."""
        return share * self.budget - (monotonic() - self.start)


@dataclass
class Tries:
    """What was tried.

    Attributes:
        rows: of all trials of whole cases.
        cases: in their order, those of the first part first.
        first_part: how many cases all candidates ran.
        seconds_per_trial: wall-clock time of a trial.
    """

    rows: list[TrialRow] = field(default_factory=list)
    cases: list[Cell] = field(default_factory=list)
    first_part: int = 0
    seconds: float = 0.0

    @property
    def seconds_per_trial(self) -> float:
        """Wall-clock time of a trial so far, building and drawing included [s]."""
        return self.seconds / max(len(self.rows), 1)

    @property
    def trials(self) -> pd.DataFrame:
        """The rows as a table of results, with the parts of selectors and facts of scenarios."""
        found: pd.DataFrame = with_facts(with_selected(pd.DataFrame(self.rows)))
        return found


def candidates(added: Sequence[str] = ()) -> list[Contender]:
    """List what is tried, each at its tuned parameters where there are some, and what is added.

    Raises:
        DikbenchError: if something that is added is no formulation.
    """
    made = [contender(_tuned(parse_selector(text))) for text in CANDIDATES]
    return list(dict.fromkeys([*made, *map(contender, added)]))


def _tuned(selector: Selector) -> Selector:
    """Return a formulation at its tuned parameters, where there are some."""
    known = read_tuned(file_for(selector)).get(key_of(selector))
    if known is None:
        return selector
    return Selector(selector.name, {**selector.parameters, "tuned": "true"})


def try_all(
    cases: Cases,
    contenders: Sequence[Contender],
    needs: Sequence[Need],
    evaluate: Evaluate,
    clock: Clock,
    reserved: Callable[[float], float],
    progress: Callable[[str], object] = lambda _: None,
    kept: Sequence[Contender] = (),
) -> tuple[Tries, list[Contender]]:
    """Try formulations on case after case: all of them first, then those that did best.

    The first case measures how long one takes; a case is begun only if it is likely to end in time,
    and every formulation runs all of it, so that rates compare like with like.

    Args:
        cases: the cases; fewer are run where they come to an end. A family that takes too long is
            left out.
        contenders: what is tried.
        needs: by which it is chosen who goes on.
        evaluate: runs trials.
        clock: of the budget.
        reserved: by the wall-clock time of a trial [s], the time [s] that the rest will take.
        progress: is told what is done.
        kept: who goes on in any case.

    Returns:
        What was tried, and who went on.
    """
    tries, every = Tries(), iter(cases)
    begun = monotonic()

    def part(those: Sequence[Contender], plants: Sequence[Selector], until: float) -> None:
        """Run cases until a share of the budget is spent; one at least."""
        first, ran = monotonic(), 0
        while ran == 0 or _goes_on(tries, clock, until, (monotonic() - first) / ran):
            start = monotonic()
            cell = next(every, None)
            if cell is None:
                return
            rows = _rows(cell, those, plants, evaluate, clock)
            if not rows:
                return
            tries.rows += rows
            tries.cases.append(cell)
            ran += 1
            took = monotonic() - start
            others = (start - begun) / max(len(tries.cases) - 1, 1)
            if took > max(LONGEST_CASE * clock.budget, SLOWER * others):
                cases.leave_out(cell, f"after a case that took {took:.0f} s of the budget")
            progress(f"{len(tries.rows)} trials of {len(tries.cases)} cases")

    part(contenders, [IDEAL], FIRST_PART)
    tries.first_part = len(tries.cases)
    tries.seconds = monotonic() - begun
    going_on = _finalists(tries, contenders, needs, kept) if tries.rows else list(contenders)
    until = max(1 - reserved(tries.seconds_per_trial) / clock.budget, LEAST_OF_BOTH)
    part(going_on, [IDEAL, DISTURBED], until)
    tries.seconds = monotonic() - begun
    return tries, going_on


def _rows(
    cell: Cell,
    contenders: Sequence[Contender],
    plants: Sequence[Selector],
    evaluate: Evaluate,
    clock: Clock,
) -> list[TrialRow]:
    """Run a case; nothing is kept of it where time runs out meanwhile."""
    scenario, seed = cell
    trials = [
        Trial(each.formulation, scenario, each.solver, plant, reference, seed)
        for each in contenders
        for plant in plants
        for reference in (REFERENCES if plant is IDEAL else ("time",))
    ]
    rows: list[TrialRow] = []
    for number in range(0, len(trials), TRIALS_AT_ONCE):
        if clock.left_until(LATEST) < 0:
            return []
        rows += evaluate(trials[number : number + TRIALS_AT_ONCE])
    return rows


def _goes_on(tries: Tries, clock: Clock, until: float, each: float) -> bool:
    """Say whether another case is begun, of which each takes so long [s].

    Of too few cases nothing can be said, and all that is done afterwards waits for these.
    """
    if len(tries.cases) < FEWEST_CASES:
        until = max(until, LATEST)
    return clock.left_until(until) > each


def _finalists(
    tries: Tries, contenders: Sequence[Contender], needs: Sequence[Need], kept: Sequence[Contender]
) -> list[Contender]:
    """Choose who goes on: by the mean rate over the needs, and who is kept in any case."""
    trials = tries.trials
    score: dict[tuple[str, str], float] = {}
    for need in needs:
        part = counted(trials, need.setting)
        if part.empty:
            continue
        found = rates(part, need.met(part))
        pairs = found.contenders.itertuples(index=False, name=None)
        for pair, rate in zip(pairs, found.rate, strict=True):
            score[pair] = score.get(pair, 0.0) + float(rate)
    ordered = sorted(
        contenders,
        key=lambda each: -score.get((str(each.formulation), str(each.solver)), 0.0),
    )
    chosen = [*ordered[:FINALISTS], *kept]
    return [each for each in contenders if each in chosen]


def plain(row: TrialRow) -> dict[str, Any]:
    """Return a row without what describes the process that ran it."""
    return {name: value for name, value in row.items() if name != "described"}
