"""The timing pass: recorded problems replayed to every law and solver, on one core, one thread."""

from __future__ import annotations

import gc
import os
import random
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from time import perf_counter_ns
from typing import Final

import numpy as np

from dikbench.arrays import Array
from dikbench.plugins.building import make_formulation
from dikbench.problem.constraints import linearize_all
from dikbench.problem.problem import DikProblem, Formulation, Solve
from dikbench.results.columns import RATES
from dikbench.robots.kinematics import Kinematics
from dikbench.run.trial_row import Row, scenario_of, solve_of
from dikbench.scenario.plant import Plant
from dikbench.scenario.scenario import Scenario
from dikbench.simulation.closed_loop import simulate
from dikbench.simulation.control_step import TrialEnded, control_step
from dikbench.solvers.checked_solve import CheckedSolve, make_solve
from dikbench.statistics.stability import verdict

LEAD_IN: Final = 5
"""Problems that are replayed before each timed segment: they bring back what another cell drove out
of the caches, and a warm start to where the segment begins."""

Cell = tuple[str, str]
"""The selectors of a law and its solver."""

PARTS: Final = ("law", "own", "core", "wrapper")
"""The whole call of the law; of it the law's own, the solver library's and its wrapper's share."""


@dataclass(frozen=True)
class _Recording:
    """A law that keeps the problems it is given."""

    law: Formulation
    problems: list[DikProblem]

    def velocity(self, problem: DikProblem, solve: Solve) -> Array:
        self.problems.append(problem)
        return self.law.velocity(problem, solve)


def record_problems(scenario: Scenario, law: Formulation, count: int) -> list[DikProblem]:
    """The problems of a contiguous segment from the middle of a run of a law without solver."""
    recording = _Recording(law, [])
    simulate(scenario, recording, make_solve(None, None), Plant())
    problems = recording.problems
    first = max(0, (len(problems) - count) // 2)
    return problems[first : first + count]


def time_scenario(
    selector: str, seed: int, cells: Sequence[Cell], reference: str, problems: int, rounds: int
) -> list[Row]:
    """Time every cell on one scenario's problems.

    In every round each cell solves the whole segment, in a new random order of the cells, so that
    drift of the machine hits all alike. A sample is one call of the law with its solver.

    Args:
        selector: the scenario.
        seed: its seed.
        cells: laws and solvers.
        reference: the law that drives the recorded run.
        problems: number of problems.
        rounds: how often each cell solves all of them.

    Returns:
        A row per cell (see `dikbench.results.columns`).
    """
    scenario = scenario_of(selector, seed)
    segment = record_problems(scenario, make_formulation(reference), problems)
    laws = [(make_formulation(law), solve_of(law, solver, checks=False)) for law, solver in cells]
    samples = np.full((len(cells), len(PARTS), rounds, len(segment)), np.nan)
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
                    samples[index, :, max(turn, 0)] = _replay(*laws[index], segment)
    return [
        {
            "formulation": law,
            "solver": solver,
            "scenario": selector,
            **_summary(samples[index], kinematics),
        }
        for index, (law, solver) in enumerate(cells)
    ]


@contextmanager
def undisturbed() -> Iterator[None]:
    """Keep this process on one core, where the system lets us, and the garbage collector away."""
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


def _replay(law: Formulation, solve: CheckedSolve, segment: Sequence[DikProblem]) -> Array:
    """Time the law on each problem, (parts, problems) [ns]; NaN from where it breaks on."""
    times = np.full((len(PARTS), len(segment)), np.nan)
    found = []
    try:
        for problem in segment[:LEAD_IN]:
            control_step(law, problem, solve)
        for problem in segment:
            outcome = control_step(law, problem, solve)
            found.append((outcome.law_ns, solve.solve_ns, solve.core_ns))
    except TrialEnded:
        pass
    if found:
        whole, inside, core = np.array(found, dtype=float).T
        times[:, : len(found)] = whole, whole - inside, core, inside - core
    return times


def _time_kinematics(scenario: Scenario, segment: Sequence[DikProblem]) -> Array:
    """Time of setting each problem up again, (problems,) [ns], as `simulate` does it."""
    robot, tracking = scenario.robot, scenario.tracking
    kinematics = Kinematics(robot)
    found = []
    for number, given in enumerate(segment):
        target, twist = scenario.targets[number % len(scenario.targets)]
        start = perf_counter_ns()
        kinematics.update(given.q)
        tasks = [tracking.linearize(kinematics, target, twist)]
        for secondary in scenario.tasks:
            tasks.append(secondary.linearize(kinematics))
        DikProblem(robot, given.q, given.v_prev, given.dt, tasks, robot.limits.at(given.q))
        linearize_all(scenario.constraints, kinematics, given.v_prev, given.dt)
        found.append(perf_counter_ns() - start)
    return np.array(found, dtype=float)


def _summary(samples: Array, kinematics: Array) -> Row:
    """What is reported of one cell: samples (parts, rounds, problems), kinematics, all [ns]."""
    law = samples[PARTS.index("law")]
    timed = law[~np.isnan(law)] / 1e3
    if not len(timed):
        return {}
    own, core, wrapper = (
        float(np.nanmedian(samples[PARTS.index(part)])) / 1e3 for part in ("own", "core", "wrapper")
    )
    shared = float(np.median(kinematics)) / 1e3
    return {
        "kinematics_time_median_us": shared,
        "law_time_median_us": float(np.median(timed)),
        "law_own_time_median_us": own,
        "solver_core_time_median_us": core,
        "solver_wrapper_time_median_us": wrapper,
        "law_time_p99_us": float(np.quantile(timed, 0.99)),
        "law_time_p999_us": float(np.quantile(timed, 0.999)),
        "law_time_max_us": float(timed.max()),
        **{
            f"missed_{rate}_hz_share": float(np.mean(timed + shared > 1e6 / rate)) for rate in RATES
        },
        "timing_samples": len(timed),
        "timing_verdict": verdict(law),
    }
