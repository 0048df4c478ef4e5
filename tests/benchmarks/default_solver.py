"""Which solver a formulation should get where none is named: `make benchmark-solvers`.

    python tests/benchmarks/default_solver.py [--programs N] [--scenario S ...] [--solver S ...]

The programs of one closed-loop run of every formulation that solves quadratic or linear programs,
over one scenario of every family, are solved again by each solver, in their order (warm starts need
it). Printed for each kind of program: the share that got no answer though it has a feasible point,
the share of control steps whose answers fail the recheck, and the times as ratios to the first.
"""

from __future__ import annotations

import os

for _name in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"):
    os.environ[_name] = "1"  # before numpy is imported

import argparse
import gc
import sys
import warnings
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from dikbench.arrays import Array
from dikbench.errors import DikbenchError, Infeasible, SolverFailed
from dikbench.plugins.building import make_formulation, make_scenario
from dikbench.plugins.finding import plugins
from dikbench.problem import program_of
from dikbench.programs.quadratic_program import ProgramKind, QuadraticProgram
from dikbench.scenario.plant import Ideal
from dikbench.simulation.closed_loop import simulate
from dikbench.solvers.catalogue.back_ends import parse_solver, why_not
from dikbench.solvers.checked_solve import make_solve

SOLVERS = (
    "daqp",
    "daqp[interface=warm]",
    "clarabel",
    "piqp",
    "piqp[interface=warm]",
    "proxqp",
    "osqp[preset=high]",
    "daqp[then=clarabel]",
    "daqp[then=piqp]",
    "daqp[interface=warm,then=clarabel]",
    "daqp[interface=warm,then=piqp]",
)
KINDS: tuple[ProgramKind, ...] = ("qp", "lp")
RECORDED_WITH = "daqp[then=clarabel]"


@dataclass
class Recorder:
    """A `solve` that keeps the programs of each control step."""

    solve: Any
    steps: list[list[QuadraticProgram]] = field(default_factory=list)

    def __getattr__(self, name: str) -> Any:
        """Everything else is that of the `solve`."""
        return getattr(self.solve, name)

    def begin_step(self, step: int) -> None:
        """Begin a list of programs."""
        self.steps.append([])
        self.solve.begin_step(step)

    def __call__(self, program: Any) -> Array:
        """Solve it, and keep it unless its bounds contradict each other."""
        lower, upper = program.lb, program.ub
        if lower is None or upper is None or (lower <= upper).all():
            self.steps[-1].append(program)
        x: Array = self.solve(program)
        return x


@dataclass
class Tally:
    """What came of the programs of one kind with one solver."""

    programs: int = 0
    unanswered: int = 0
    steps: int = 0
    wrong: int = 0
    times: list[int] = field(default_factory=list)
    where: dict[str, int] = field(default_factory=dict)


def recorded(law: str, scenario: str, most: int) -> list[list[QuadraticProgram]]:
    """The programs of up to so many contiguous control steps in the middle of a run."""
    formulation = make_formulation(law)
    recorder = Recorder(make_solve(parse_solver(RECORDED_WITH), program_of(formulation)))
    solve: Any = recorder
    simulate(make_scenario(scenario), formulation, solve, Ideal())
    steps = [step for step in recorder.steps if step]
    first = max(0, (len(steps) - most) // 2)
    return steps[first : first + most]


def replay(steps: list[list[QuadraticProgram]], text: str, kind: Any, name: str, to: Tally) -> None:
    """Solve all programs again, and add what came of it to the tally."""
    solve = make_solve(parse_solver(text), kind)
    solve.begin_run(len(steps))
    for number, programs in enumerate(steps):
        solve.begin_step(number)
        for program in programs:
            spent = solve.solve_ns
            try:
                solve(program)
            except SolverFailed:
                to.unanswered += 1
                to.where[name] = to.where.get(name, 0) + 1
            except Infeasible:
                continue
            to.programs += 1
            to.times.append(solve.solve_ns - spent)
    to.steps += len(steps)
    to.wrong += int(solve.rechecked().lied.sum())


def print_table(kind: str, tallies: dict[str, Tally]) -> None:
    """Print one kind's table; times as ratios to the median of the first solver."""
    base = float(np.median(next(iter(tallies.values())).times))
    print(f"\n{kind}: {next(iter(tallies.values())).programs} programs, {base / 1e3:.0f} us")
    print(f"{'solver':38}{'no answer':>18}{'fail recheck':>18}{'median':>8}{'p99':>8}{'mean':>8}")
    for text, tally in tallies.items():
        share = tally.unanswered / tally.programs
        wrong = tally.wrong / tally.steps
        times = np.array(tally.times) / base
        print(
            f"{text:38}{tally.unanswered:8} {share:9.4%}{tally.wrong:8} {wrong:9.4%}"
            f"{np.median(times):8.2f}{np.percentile(times, 99):8.2f}{times.mean():8.2f}"
        )
        if tally.where:
            most = sorted(tally.where.items(), key=lambda item: -item[1])[:4]
            print("    without answer: " + ", ".join(f"{name} {count}" for name, count in most))


def main() -> None:
    """Record, solve and print."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--programs", type=int, default=150, help="steps of a run (default: 150)")
    parser.add_argument("--scenario", action="append", help="default: one of every family")
    parser.add_argument("--solver", action="append", help="default: those of the decision")
    arguments = parser.parse_args()
    warnings.simplefilter("ignore")
    if hasattr(os, "sched_setaffinity"):
        os.sched_setaffinity(0, {max(os.sched_getaffinity(0))})
    families = plugins("scenario").items()
    unaided = [name for name, f in families if not any(p.required for p in f.parameters.values())]
    laws = {name: program_of(make_formulation(name)) for name in plugins("formulation")}
    solvers = arguments.solver or SOLVERS
    tallies: dict[ProgramKind, dict[str, Tally]] = {
        kind: {text: Tally() for text in solvers if not why_not(parse_solver(text), kind)}
        for kind in KINDS
    }
    gc.disable()
    for scenario in arguments.scenario or unaided:
        for law, kind in laws.items():
            if kind is None or kind not in KINDS:
                continue
            try:
                steps = recorded(law, scenario, arguments.programs)
            except DikbenchError as error:
                print(f"{law} over {scenario} is left out: {error}", file=sys.stderr)
                continue
            for text, tally in tallies[kind].items():
                replay(steps, text, kind, f"{law} over {scenario}", tally)
        gc.collect()
    for program, found in tallies.items():
        print_table(program, found)


if __name__ == "__main__":
    main()
