"""What the metrics and the recheck of solutions cost per control step, alone and together.

    python tests/benchmarks/measuring.py

Prints microseconds of CPU per step, the median over interleaved rounds on one core and one thread,
and their ratio to the kinematics of a step (Jacobians and placement of the task frame by Pinocchio)
and to a tick of Pink, where it is installed, in the same rounds.
"""

from __future__ import annotations

import os

for _name in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"):
    os.environ[_name] = "1"  # before numpy is imported

import gc
import random
import statistics
import warnings
from collections.abc import Callable
from time import process_time

from dikbench.metrics import Measured, measure
from dikbench.plugins.building import make_formulation, make_scenario
from dikbench.problem.problem import program_of
from dikbench.robots.kinematics import Kinematics
from dikbench.scenario.plant import Ideal
from dikbench.scenario.scenario import Scenario
from dikbench.simulation.clock import ReferenceMode
from dikbench.simulation.closed_loop import simulate
from dikbench.solvers.catalogue.back_ends import parse_solver
from dikbench.solvers.checked_solve import make_solve
from dikbench.solvers.recheck.rechecked import RecheckedSteps, Solved

SCENARIO = "near-miss[robot=panda,miss=0.02,speed=0.25]"
SEEDS = (1, 2, 3)
TOGETHER = 12
"""So many runs of one scenario are measured together."""

ROUNDS = 9

Work = Callable[[], int]
"""Does something and says for how many steps."""


def runs_of(scenario: Scenario, mode: ReferenceMode) -> list[Measured]:
    """As many runs of a scenario as are measured together, of laws that damp more and more."""
    found = []
    for number in range(TOGETHER):
        law = make_formulation(f"dls[damping={0.01 * (number + 1)}]")
        run = simulate(scenario, law, make_solve(None, None), Ideal(), mode)
        found.append(Measured(run.trace, scenario, run.jacobians, run.status))
    return found


def measuring(runs: list[Measured], together: int) -> Work:
    """Measure runs, so many at once."""

    def work() -> int:
        for first in range(0, len(runs), together):
            measure(runs[first : first + together])
        return sum(run.trace.steps for run in runs)

    return work


def rechecking(scenario: Scenario, law: str) -> Work:
    """Recheck the solutions of a run."""
    kept: list[tuple[list[Solved], float]] = []
    recheck = RecheckedSteps.recheck

    def keep(steps: RecheckedSteps, solved: list[Solved], tolerance: float) -> None:
        kept.append((list(solved), tolerance))
        recheck(steps, solved, tolerance)

    formulation = make_formulation(law)
    solve = make_solve(parse_solver("daqp[interface=warm]"), program_of(formulation))
    RecheckedSteps.recheck = keep  # type: ignore[assignment, method-assign]
    steps = simulate(scenario, formulation, solve, Ideal()).trace.steps
    RecheckedSteps.recheck = recheck  # type: ignore[method-assign]

    def work() -> int:
        for solved, tolerance in kept:
            RecheckedSteps(steps + 1).recheck(solved, tolerance)
        return steps

    return work


def kinematics(runs: list[Measured]) -> Work:
    """Compute the kinematics of every step."""

    def work() -> int:
        for run in runs:
            at = Kinematics(run.scenario.robot)
            for q in run.trace.q:
                at.update(q)
                at.placement(run.scenario.robot.frame_id)
                at.task_jacobian()
        return sum(run.trace.steps for run in runs)

    return work


def main() -> None:
    """Measure and print."""
    warnings.simplefilter("ignore")
    if hasattr(os, "sched_setaffinity"):
        os.sched_setaffinity(0, {max(os.sched_getaffinity(0))})
    scenarios = [make_scenario(SCENARIO, seed) for seed in SEEDS]
    by_clock = [run for scenario in scenarios for run in runs_of(scenario, "time")]
    by_path = [run for scenario in scenarios for run in runs_of(scenario, "path")]
    works: dict[str, Work] = {
        "kinematics": kinematics(by_clock),
        "by the clock, alone": measuring(by_clock, 1),
        f"by the clock, {TOGETHER} together": measuring(by_clock, TOGETHER),
        "along the path, alone": measuring(by_path, 1),
        f"along the path, {TOGETHER} together": measuring(by_path, TOGETHER),
        "recheck, qp": rechecking(scenarios[0], "qp"),
        "recheck, lp-alpha": rechecking(scenarios[0], "lp-alpha"),
    }
    try:
        from peer_ticks import pink_tick

        works["Pink"] = pink_tick(scenarios[0])
    except ImportError as error:
        print(f"Pink is left out: {error}")
    gc.disable()
    samples: dict[str, list[float]] = {name: [] for name in works}
    order, shuffle = list(works), random.Random(0).shuffle
    for turn in range(ROUNDS + 1):
        shuffle(order)
        for name in order:
            start = process_time()
            steps = works[name]()
            if turn:  # the first round warms up
                samples[name].append((process_time() - start) / steps)
            gc.collect()
    yardsticks = [name for name in ("kinematics", "Pink") if name in samples]
    print(f"{'per control step':32}{'us':>8}" + "".join(f"{'/ ' + y:>14}" for y in yardsticks))
    for name, values in samples.items():
        ratios = [
            statistics.median(a / b for a, b in zip(values, samples[y], strict=True))
            for y in yardsticks
        ]
        shown = "".join(f"{ratio:14.3f}" for ratio in ratios)
        print(f"{name:32}{1e6 * statistics.median(values):8.2f}{shown}")


if __name__ == "__main__":
    main()
