"""The timing pass: recorded problems replayed to every law and solver, on one core, one thread."""

from __future__ import annotations

import gc
import os
import random
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from dikbench.array import Array
from dikbench.control_step import TrialEnded, control_step
from dikbench.plants import PLANTS
from dikbench.problem import DikProblem, Formulation, Solve
from dikbench.registry import make_formulation
from dikbench.run.worker import Row, scenario_of, solve_of
from dikbench.scenario import Scenario
from dikbench.simulation import simulate
from dikbench.solvers.checked import CheckedSolve, make_solve

WARM_UP = 10
"""Problems that each cell solves before its clock counts."""

Cell = tuple[str, str]
"""The selectors of a law and its solver."""


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
    simulate(scenario, recording, make_solve(None, None), PLANTS["ideal"])
    problems = recording.problems
    first = max(0, (len(problems) - count) // 2)
    return problems[first : first + count]


def time_scenario(
    selector: str, seed: int, cells: Sequence[Cell], reference: str, problems: int, rounds: int
) -> list[Row]:
    """Time every cell on one scenario's problems.

    The cells are interleaved and shuffled in every round, so that drift of the machine hits all
    alike; each sample is one call of the law, its solver included, the recheck excluded.

    Args:
        selector: the scenario.
        seed: its seed.
        cells: laws and solvers.
        reference: the law that drives the recorded run.
        problems: number of problems.
        rounds: how often each cell solves all of them.

    Returns:
        A row per cell: law_time_median_us, law_time_p99_us, solve_time_median_us (of it, inside
        the solver and its interface), timing_samples.
    """
    segment = record_problems(scenario_of(selector, seed), make_formulation(reference), problems)
    laws = [(make_formulation(law), solve_of(law, solver, checks=False)) for law, solver in cells]
    law_ns = np.full((len(cells), rounds, len(segment)), np.nan)
    solve_ns = np.full_like(law_ns, np.nan)
    order = list(range(len(cells)))
    shuffle = random.Random(0).shuffle
    _pin()
    gc.collect()
    gc.disable()
    try:
        for law, solve in laws:
            _replay(law, solve, segment[:WARM_UP])
        for turn in range(rounds):
            shuffle(order)
            for index in order:
                law, solve = laws[index]
                for k, (total, inside) in enumerate(_replay(law, solve, segment)):
                    law_ns[index, turn, k], solve_ns[index, turn, k] = total, inside
    finally:
        gc.enable()
    return [
        {
            "formulation": law,
            "solver": solver,
            "scenario": selector,
            **_summary(law_ns[index].ravel(), solve_ns[index].ravel()),
        }
        for index, (law, solver) in enumerate(cells)
    ]


def _replay(
    law: Formulation, solve: CheckedSolve, segment: Sequence[DikProblem]
) -> list[tuple[int, int]]:
    """Time the law on each problem: (whole call, inside the solver) [ns]; short if it breaks."""
    samples = []
    try:
        for problem in segment:
            outcome = control_step(law, problem, solve)
            samples.append((outcome.law_ns, solve.solve_ns))
    except TrialEnded:
        pass
    return samples


def _summary(law_ns: Array, solve_ns: Array) -> Row:
    timed = ~np.isnan(law_ns)
    if not timed.any():
        return {}
    return {
        "law_time_median_us": float(np.median(law_ns[timed])) / 1e3,
        "law_time_p99_us": float(np.quantile(law_ns[timed], 0.99)) / 1e3,
        "solve_time_median_us": float(np.median(solve_ns[timed])) / 1e3,
        "timing_samples": int(timed.sum()),
    }


def _pin() -> None:
    """Keep this process on one core, where the system lets us."""
    if hasattr(os, "sched_setaffinity"):
        os.sched_setaffinity(0, {max(os.sched_getaffinity(0))})
