"""What the laws that need no solver cost, as ratios to `dls`: `make benchmark-laws`.

Every law answers the same recorded problems, one scenario with a null space and one that passes a
singularity, in interleaved rounds on one core and one thread, garbage collection off. A figure is
the median over rounds of the ratio within each round; numpy's pseudo-inverse stands beside them.
"""

from __future__ import annotations

import os

for _name in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"):
    os.environ[_name] = "1"  # before numpy is imported

import argparse
import gc
import random
import statistics
from collections.abc import Callable
from time import perf_counter

import numpy as np

from dikbench.arrays import Array
from dikbench.plugins.building import make_formulation, make_scenario
from dikbench.plugins.finding import plugins
from dikbench.problem import DikProblem, program_of
from dikbench.run.timing import record_problems
from dikbench.solvers.checked_solve import make_solve

SCENARIOS = ("speed-sweep[robot=panda]", "near-miss[robot=ur5,singularity=wrist,miss=0.05]")
REFERENCE = "dls"
PROBLEMS = 100
NO_SOLVER = make_solve(None, None)

Law = Callable[[DikProblem], Array]


def laws() -> dict[str, Law]:
    """Every registered law that needs no solver, and numpy's pseudo-inverse."""

    def asked(name: str) -> Law:
        law = make_formulation(name)
        return lambda problem: law.velocity(problem, NO_SOLVER)

    known = {name: make_formulation(name) for name in plugins("formulation")}
    found = {name: asked(name) for name, law in known.items() if program_of(law) is None}
    found["numpy pinv"] = lambda problem: np.linalg.pinv(problem.primary.J) @ problem.primary.V
    return found


def medians(problems: list[DikProblem], rounds: int) -> dict[str, list[float]]:
    """Median time of one answer [s] of each law in every round; the order is shuffled."""
    contenders = laws()
    samples: dict[str, list[float]] = {name: [] for name in contenders}
    shuffle, order = random.Random(0).shuffle, list(contenders)
    for turn in range(rounds + 1):
        shuffle(order)
        for name in order:
            law, spent = contenders[name], []
            for problem in problems:
                start = perf_counter()
                law(problem)
                spent.append(perf_counter() - start)
            if turn:  # the first round warms up
                samples[name].append(statistics.median(spent))
    return samples


def main() -> None:
    """Measure and print."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--rounds", type=int, default=30, help="measured rounds (default: 30)")
    rounds = parser.parse_args().rounds
    if hasattr(os, "sched_setaffinity"):
        os.sched_setaffinity(0, {max(os.sched_getaffinity(0))})
    gc.disable()
    for scenario in SCENARIOS:
        problems = record_problems(make_scenario(scenario), make_formulation(REFERENCE), PROBLEMS)
        samples = medians(problems, rounds)
        print(f"{scenario}\n{'law':24}{'median us':>10}{'over dls':>10}{'least':>8}{'most':>8}")
        for name, times in samples.items():
            ratios = [a / b for a, b in zip(times, samples[REFERENCE], strict=True)]
            micro = 1e6 * statistics.median(times)
            middle = statistics.median(ratios)
            print(f"{name:24}{micro:10.1f}{middle:10.2f}{min(ratios):8.2f}{max(ratios):8.2f}")


if __name__ == "__main__":
    main()
