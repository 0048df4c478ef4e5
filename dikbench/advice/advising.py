"""Advice for an arm: looked at, tried, answered."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from itertools import product
from typing import Any, Final

import pandas as pd

from dikbench.advice.answering import Answer, Standing, answers
from dikbench.advice.arm import Arm
from dikbench.advice.cases import Cases
from dikbench.advice.contender import Contender
from dikbench.advice.evaluating import Evaluate, evaluator, while_time_is_left
from dikbench.advice.needs import Need
from dikbench.advice.searched import searched
from dikbench.advice.trying import CANDIDATES, IDEAL, Clock, Tries, try_all
from dikbench.advice.worst import Search, search_worst
from dikbench.errors import DikbenchError
from dikbench.results.selected import with_selected
from dikbench.run.block_work import WORK
from dikbench.run.in_workers import RunSettings
from dikbench.run.pool import available_cores, workers
from dikbench.run.timing import time_scenario
from dikbench.run.trial_row import TrialRow
from dikbench.selector import Selector, parse_selector
from dikbench.statistics.success import with_facts
from dikbench.study.trial import NO_SOLVER, Trial

SHORTEST_PAGE_S: Final = 6.0
"""Time that figures, the page and the worst run take at least ..."""

STARTS_A_PAGE: Final = 3.0
"""... and so many times that of the first start of the workers, which tells how busy the machine
is ..."""

MOST_OF_PAGE: Final = 0.25
"""... but for more than this share of the budget nothing else waits."""

TIMES_S: Final = 4.0
"""Time that the timing pass takes ..."""

LONGEST_TIMES: Final = 3.0
"""... and how many times that it may take."""

OTHER_SOLVERS: Final = ("daqp[interface=warm]", "piqp")
"""Solvers with which the recommended formulation is timed beside its own."""

TIMED_PROBLEMS: Final = 60
TIMED_ROUNDS: Final = 3

MISSES: Final = ("0.005", "0.01", "0.02", "0.05")
SPEEDS: Final = ("0.1", "0.3", "1.0")
"""The grid of the phase diagram of near misses."""

SEARCHED: Final = 120
"""Cases of the search of the worst one for which time is kept ..."""

FEWEST_SEARCHED: Final = 16
MOST_SEARCHED: Final = 300
"""... and how many it has at least and at most, by the time that is left then."""

COMPARED: Final = "dls"
"""What the phase diagram shows beside what is recommended: what most people use."""


@dataclass(frozen=True, eq=False)
class Advice:
    """Advice for an arm.

    Attributes:
        arm: the arm.
        dt: control period [s].
        answers: to each need.
        tries: what was tried.
        went_on: who ran all cases.
        left_out: why families have no case.
        chosen: what is recommended for the first need that has an answer; None where none has.
        times: rows of the timing pass.
        search: of the worst case of what is chosen; None where there is none.
        phase: trials of the phase diagram.
        no_search, no_phase: why there is none of them.
    """

    arm: Arm
    dt: float
    answers: Sequence[Answer]
    tries: Tries
    went_on: Sequence[Contender]
    left_out: dict[str, str]
    chosen: Standing | None
    times: Sequence[TrialRow] = ()
    search: Search | None = None
    phase: pd.DataFrame | None = None
    no_search: str = ""
    no_phase: str = ""


def advise(
    arm: Arm,
    dt: float,
    cases: Cases,
    contenders: Sequence[Contender],
    needs: Sequence[Need],
    clock: Clock,
    seed: int,
    settings: RunSettings,
    progress: Callable[[str], object] = lambda _: None,
) -> Advice:
    """Try formulations on the cases of an arm within a budget, and answer each need.

    Args:
        arm: the arm.
        dt: control period [s].
        cases: its cases.
        contenders: what is tried.
        needs: what is asked for.
        clock: of the budget.
        seed: of the search of the worst case.
        settings: how trials are run.
        progress: is told what is done.

    Raises:
        DikbenchError: if no case can be made of this arm.
    """
    limit = min(settings.trial_timeout, max(10.0, clock.budget / 6))
    added = [each for each in contenders if each.formulation.name not in _shipped()]
    with workers(settings.jobs, WORK, settings.trial_memory) as pool:
        evaluate = evaluator(pool, limit)
        page = max(SHORTEST_PAGE_S, STARTS_A_PAGE * _start(pool, clock))
        page = min(page, MOST_OF_PAGE * clock.budget)

        def reserved(trial: float) -> float:
            """Return how long all else takes [s], by the time of a trial."""
            return page + TIMES_S + trial * (SEARCHED + 2 * len(MISSES) * len(SPEEDS))

        tries, went_on = try_all(
            cases, contenders, needs, evaluate, clock, reserved, progress, added
        )
        if not tries.rows:
            raise DikbenchError(_no_case(arm, cases, clock))
        found = answers(needs, on_ideal_plant(tries.trials))
        chosen = next((each.first for each in found if each.first is not None), None)
        advice = Advice(arm, dt, found, tries, went_on, cases.left_out, chosen)
        if chosen is None:
            return replace(advice, no_search="nothing is recommended", no_phase="likewise")
        progress("times")
        times = _times(pool, tries, chosen)
        progress("the worst case")
        cells = 2 * len(MISSES) * len(SPEEDS) if cases.has("near-miss") else 0
        grid = cells * tries.seconds_per_trial

        def left_for_search() -> float:
            return clock.left_until(1.0) - page - grid

        def left_for_phase() -> float:
            return clock.left_until(1.0) - page

        search, no_search = _search(advice, cases, chosen, evaluate, left_for_search, seed)
        progress("the phase diagram")
        phase, no_phase = _phase(cases, chosen, evaluate, left_for_phase)
        return replace(
            advice,
            times=times,
            search=search,
            no_search=no_search,
            phase=phase,
            no_phase=no_phase,
        )


def _no_case(arm: Arm, cases: Cases, clock: Clock) -> str:
    """Say why no case was run."""
    if len(cases.left_out) < len(cases.given):
        return (
            f"robot {arm.robot.name}: in {clock.budget:g} s not one case was run with everything "
            "that is tried; valid: a larger --budget"
        )
    family, why = next(iter(cases.left_out.items()))
    return (
        f"robot {arm.robot.name}: no case of {len(cases.given)} families can be made of it; "
        f"{family}: {why}"
    )


def _shipped() -> set[str]:
    return {parse_selector(text).name for text in CANDIDATES}


def on_ideal_plant(trials: pd.DataFrame) -> pd.DataFrame:
    """Return the rows of the plant without noise and delay."""
    found: pd.DataFrame = trials[trials["plant"].eq(str(IDEAL))]
    return found


def chosen_contender(chosen: Standing) -> Contender:
    """Return the selectors of what is recommended."""
    return Contender(parse_selector(chosen.formulation), parse_selector(chosen.solver))


def _start(pool: Any, clock: Clock) -> float:
    """Start the workers; return how long that took since the clock began [s]."""
    pool.schedule(available_cores).result()
    return clock.spent * clock.budget


def _times(pool: Any, tries: Tries, chosen: Standing) -> list[TrialRow]:
    """Time what is recommended, with its solver and some others, on a case that it ran."""
    own = chosen_contender(chosen)
    cells = [(own.formulation, own.solver)]
    if own.solver != NO_SOLVER:
        cells += [(own.formulation, parse_selector(text)) for text in OTHER_SOLVERS]
    scenario, seed = tries.cases[0]
    arguments = (scenario, seed, cells, COMPARED, TIMED_PROBLEMS, TIMED_ROUNDS)
    limit = LONGEST_TIMES * TIMES_S
    try:
        rows: list[TrialRow] = pool.schedule(time_scenario, args=arguments, timeout=limit).result()
    except Exception:  # a law may end its process, or take too long: no times
        return []
    return rows


def _search(
    advice: Advice,
    cases: Cases,
    chosen: Standing,
    evaluate: Evaluate,
    left: Callable[[], float],
    seed: int,
) -> tuple[Search | None, str]:
    """Search the near misses of the arm, or else its paths at a chosen speed, for the worst."""
    box = next((name for name in ("near-miss", "speed-sweep") if cases.has(name)), None)
    if box is None:
        return None, "neither near misses nor paths at a chosen speed can be made of this arm"
    number = int(left() / max(advice.tries.seconds_per_trial, 1e-3))
    budget = min(max(number, FEWEST_SEARCHED), MOST_SEARCHED)
    limited = while_time_is_left(evaluate, left)
    try:
        found = search_worst(
            searched(cases.given[box]),
            [chosen_contender(chosen)],
            limited,
            budget=budget,
            seed=seed,
            plant=IDEAL,
            reference="path",
        )
    except DikbenchError as error:
        return None, str(error)
    return found, ""


def _phase(
    cases: Cases, chosen: Standing, evaluate: Evaluate, left: Callable[[], float]
) -> tuple[pd.DataFrame | None, str]:
    """Run the grid of near misses of the arm."""
    if not cases.has("near-miss"):
        unknown = "with acceleration limits no motion is known that keeps all limits"
        return None, cases.left_out.get("near-miss", unknown)
    given = cases.given["near-miss"]
    laws = {chosen_contender(chosen): None, Contender(Selector(COMPARED), NO_SOLVER): None}
    trials = [
        Trial(
            each.formulation,
            Selector(given.name, {**given.parameters, "miss": miss, "speed": speed}),
            each.solver,
            IDEAL,
            "path",
            0,
        )
        for miss, speed in product(MISSES, SPEEDS)
        for each in laws
    ]
    limited = while_time_is_left(evaluate, left)
    rows = [
        row for number in range(0, len(trials), 4) for row in limited(trials[number : number + 4])
    ]
    if not any(row["steps"] for row in rows):
        return None, str(rows[0]["message"])
    found: pd.DataFrame = with_facts(with_selected(pd.DataFrame(rows)))
    return found, ""
