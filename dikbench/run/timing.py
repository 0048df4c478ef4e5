"""The timing pass: every formulation and solver on recorded problems, on one core."""

from __future__ import annotations

import gc
import os
import random
from collections.abc import Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from time import perf_counter_ns
from typing import Final

import numpy as np

from dikbench.arrays import Array
from dikbench.plugins.building import make_formulation
from dikbench.problem.posing import pose_problem
from dikbench.problem.problem import (
    DikProblem,
    Formulation,
    Solve,
    computes_kinematics,
    refusal_of,
)
from dikbench.results.columns import CONTROL_RATES_HZ
from dikbench.robots.kinematics import Kinematics
from dikbench.run.trial_row import TrialRow, scenario_of, solve_of
from dikbench.scenario.oracle import ORACLES
from dikbench.scenario.plant import Ideal
from dikbench.scenario.scenario import Scenario
from dikbench.selector import Selector
from dikbench.simulation.closed_loop import simulate
from dikbench.simulation.control_step import TrialEnded, control_step
from dikbench.simulation.status import Status
from dikbench.solvers.checked_solve import CheckedSolve, make_solve
from dikbench.statistics.stability import stability_of
from dikbench.study.plan import PlannedTrial
from dikbench.study.study import Study

LEAD_IN_PROBLEMS: Final = 5
"""Problems that are solved before each timed segment, which fill the caches and warm starts."""

FATAL_STATUSES: Final = frozenset(
    status.value for status in (Status.TIMEOUT, Status.CRASHED, Status.OUT_OF_MEMORY)
)
"""Statuses of a trial after which its formulation is not timed."""

Contender = tuple[Selector, Selector]
"""The selectors of a formulation and its solver."""

TIME_PARTS: Final = ("whole", "own", "core", "wrapper")
"""The whole call of the formulation, its own code, the solver library, the library's wrapper."""


def to_time(
    study: Study, planned: Iterable[PlannedTrial], statuses: Mapping[str, str]
) -> dict[Selector, list[Contender]]:
    """List what is timed on each scenario: what the plan of a study runs on it.

    Oracles are not timed, nor what ended its process in a trial: it would do so again, and lose all
    times.

    Args:
        study: its `timing` may name the scenarios.
        planned: its trials.
        statuses: of those that have run, by id.
    """
    chosen = () if study.timing is None else study.timing.scenarios
    found: dict[Selector, dict[Contender, None]] = {}
    fatal = set()
    for p in planned:
        contender = p.trial.formulation, p.trial.solver
        if statuses.get(p.id) in FATAL_STATUSES:
            fatal.add(contender)
        left_out = p.skip or p.trial.formulation.name in ORACLES
        if not left_out and (not chosen or str(p.trial.scenario) in chosen):
            found.setdefault(p.trial.scenario, {})[contender] = None
    wanted = {scenario: [c for c in those if c not in fatal] for scenario, those in found.items()}
    return {scenario: contenders for scenario, contenders in wanted.items() if contenders}


@dataclass(frozen=True)
class _Recording:
    """A formulation that records what another one is asked and answers."""

    formulation: Formulation
    asked: list[tuple[DikProblem, Array | None]]

    def velocity(self, problem: DikProblem, solve: Solve) -> Array:
        self.asked.append((problem, None))
        v = self.formulation.velocity(problem, solve)
        self.asked[-1] = problem, v
        return v


def record_run(
    scenario: Scenario, formulation: Formulation, solve: CheckedSolve
) -> list[tuple[DikProblem, Array | None]]:
    """Record each problem of a run of a formulation with its answer, None where it has none."""
    recording = _Recording(formulation, [])
    simulate(scenario, recording, solve, Ideal())
    return recording.asked


def record_problems(scenario: Scenario, formulation: Formulation, count: int) -> list[DikProblem]:
    """Record contiguous problems from the middle of a run of a formulation without solver."""
    problems = [asked for asked, _ in record_run(scenario, formulation, make_solve(None, None))]
    first = max(0, (len(problems) - count) // 2)
    return problems[first : first + count]


def time_scenario(
    selector: Selector,
    seed: int,
    cells: Sequence[Contender],
    reference: str,
    problems: int,
    rounds: int,
) -> list[TrialRow]:
    """Time every cell on one scenario's problems.

    In every round each cell solves the whole segment, in a new random order of the cells, so that
    drift of the machine affects all equally. A sample is one call of the formulation. Kinematics
    and tasks are timed apart, for all but formulations that compute their own: a whole tick is the
    sum of both.

    Args:
        selector: the scenario.
        seed: its seed.
        cells: formulations and solvers.
        reference: the formulation of the recorded run.
        problems: number of problems.
        rounds: number of rounds.

    Returns:
        A row per cell (see `dikbench.results.columns`).
    """
    scenario = scenario_of(selector, seed)
    segment = record_problems(scenario, make_formulation(reference), problems)
    timed = [
        (make_formulation(name), solve_of(name, solver, checks=False)) for name, solver in cells
    ]
    samples = np.full((len(cells), len(TIME_PARTS), rounds, len(segment)), np.nan)
    kinematics = np.full((rounds, len(segment)), np.nan)
    order = list(range(-1, len(cells)))  # -1: the kinematics, which all cells share
    shuffle = random.Random(0).shuffle
    with undisturbed():
        for turn in range(-1, rounds):  # the first round warms up
            shuffle(order)
            for index in order:
                if index < 0:
                    found = _time_kinematics(scenario, segment)
                    kinematics[max(turn, 0)] = found
                else:
                    samples[index, :, max(turn, 0)] = _time_formulation(*timed[index], segment)
    return [
        {
            "formulation": str(formulation),
            "solver": str(solver),
            "scenario": str(selector),
            **_summary(samples[index], 0 * kinematics if computes_kinematics(law) else kinematics),
        }
        for index, ((formulation, solver), (law, _)) in enumerate(zip(cells, timed, strict=True))
    ]


@contextmanager
def undisturbed() -> Iterator[None]:
    """Keep this process on one core, if the system allows it, without garbage collection."""
    cores = os.sched_getaffinity(0) if hasattr(os, "sched_getaffinity") else set()
    if cores:
        os.sched_setaffinity(0, {max(cores)})
    gc.collect()
    gc.disable()
    try:
        yield
    finally:
        gc.enable()
        if cores:
            os.sched_setaffinity(0, cores)


def _time_formulation(
    formulation: Formulation, solve: CheckedSolve, segment: Sequence[DikProblem]
) -> Array:
    """Time a formulation on each problem, (parts, problems) [ns]; NaN after it fails.

    A formulation that refuses such problems is not timed.
    """
    times = np.full((len(TIME_PARTS), len(segment)), np.nan)
    if refusal_of(formulation, segment[0]):
        return times
    found = []
    try:
        for problem in segment[:LEAD_IN_PROBLEMS]:
            control_step(formulation, problem, solve)
        for problem in segment:
            answer = control_step(formulation, problem, solve)
            found.append((answer.formulation_ns, solve.solve_ns, solve.core_ns))
    except TrialEnded:
        pass
    if found:
        whole, inside, core = np.array(found, dtype=float).T
        times[:, : len(found)] = whole, whole - inside, core, inside - core
    return times


def _time_kinematics(scenario: Scenario, segment: Sequence[DikProblem]) -> Array:
    """Time how each problem is posed, (problems,) [ns], as `simulate` does it."""
    kinematics, tracking = Kinematics(scenario.robot), scenario.tracking
    found = []
    for number, given in enumerate(segment):
        target, twist = scenario.targets[number % len(scenario.targets)]
        start = perf_counter_ns()
        kinematics.update(given.q)
        task = tracking.linearize(kinematics, target, twist)
        pose_problem(kinematics, given.v_prev, given.dt, task, scenario.tasks, scenario.constraints)
        found.append(perf_counter_ns() - start)
    return np.array(found, dtype=float)


def _summary(samples: Array, kinematics: Array) -> TrialRow:
    """Summarise one cell: samples (parts, rounds, problems) and kinematics, all [ns]."""
    calls = samples[TIME_PARTS.index("whole")]
    timed = calls[~np.isnan(calls)] / 1e3
    if not len(timed):
        return {}
    own, core, wrapper = (
        float(np.nanmedian(samples[TIME_PARTS.index(part)])) / 1e3
        for part in ("own", "core", "wrapper")
    )
    shared = float(np.median(kinematics)) / 1e3
    return {
        "kinematics_time_median_us": shared,
        "formulation_time_median_us": float(np.median(timed)),
        "formulation_own_time_median_us": own,
        "solver_core_time_median_us": core,
        "solver_wrapper_time_median_us": wrapper,
        "formulation_time_p99_us": float(np.quantile(timed, 0.99)),
        "formulation_time_p999_us": float(np.quantile(timed, 0.999)),
        "formulation_time_max_us": float(timed.max()),
        **{
            f"missed_{rate}_hz_share": float(np.mean(timed + shared > 1e6 / rate))
            for rate in CONTROL_RATES_HZ
        },
        "timing_samples": len(timed),
        "timing_stability": stability_of(calls),
    }
