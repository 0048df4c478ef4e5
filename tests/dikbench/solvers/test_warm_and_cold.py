"""Faster must not mean other answers: warm and cold agree on every step of the default study."""

from __future__ import annotations

from functools import cache

import numpy as np
import pytest
from makers.programs import LIBRARIES_WARN

from dikbench.arrays import Array
from dikbench.errors import CannotAnswer
from dikbench.plugins.building import make_formulation, make_scenario
from dikbench.problem import DikProblem, Formulation
from dikbench.programs.quadratic_program import QuadraticProgram
from dikbench.run.timing import record_problems
from dikbench.solvers.catalogue.back_ends import parse_solver
from dikbench.solvers.checked_solve import CheckedSolve, make_solve
from dikbench.study.study import load_study

pytestmark = LIBRARIES_WARN

DAMPING = 1e-3
"""Of `qp`, lambda."""

WHOLE_RUN = 100_000
"""More problems than any run has."""

PAIRS = [("qp", name) for name in ("osqp", "clarabel", "piqp", "proxqp", "daqp", "highs")]
PAIRS += [("lp-alpha", name) for name in ("osqp", "clarabel", "piqp", "daqp")]

CASES = [
    pytest.param(law, name, scenario, marks=() if (pair + number) % 18 == 0 else pytest.mark.long)
    for pair, (law, name) in enumerate(PAIRS)
    for number, scenario in enumerate(load_study("quick").scenarios)
]
"""Every pair on every scenario; the normal run has an eighteenth of them, in turns."""


class _Kept:
    """A solve that keeps the last program and its answer."""

    def __init__(self, solve: CheckedSolve) -> None:
        self.solve = solve
        self.cost = float("nan")

    def __call__(self, program: QuadraticProgram) -> Array:
        x = self.solve(program)
        self.cost = float(0.5 * x @ program.P @ x + program.q @ x)
        return x


def _answer(law: Formulation, problem: DikProblem, kept: _Kept) -> tuple[Array, float] | None:
    """Task velocity and cost; None where there is no answer."""
    try:
        v = law.velocity(problem, kept)  # type: ignore[arg-type]
    except CannotAnswer:
        return None
    return problem.primary.J @ v, kept.cost


@cache
def _problems(scenario: str) -> list[DikProblem]:
    """Every control step of a run, which laws only read."""
    return record_problems(make_scenario(scenario), make_formulation("dls"), WHOLE_RUN)


@pytest.mark.parametrize(("law", "name", "scenario"), CASES)
def test_warm_and_cold_agree_under_the_finest_preset(law: str, name: str, scenario: str) -> None:
    """In task velocity (m/s, rad/s) and in cost; v itself is loose in the null space."""
    problems, formulation = _problems(scenario), make_formulation(law)
    ways = []
    for interface in ("cold", "warm"):
        solver = parse_solver(f"{name}[interface={interface},preset=high]")
        solve = make_solve(solver, "qp" if law == "qp" else "lp")
        solve.begin_run(len(problems))
        found = []
        for step, problem in enumerate(problems):
            solve.begin_step(step)
            found.append(_answer(formulation, problem, _Kept(solve)))
        ways.append((found, solve.rechecked()))
    (cold, _), (warm, verdicts) = ways
    worst_velocity = worst_cost = 0.0
    for one, other in zip(cold, warm, strict=True):
        assert other is not None or one is None
        if one is None or other is None:
            continue
        worst_velocity = max(worst_velocity, float(np.abs(one[0] - other[0]).max()))
        worst_cost = max(worst_cost, abs(one[1] - other[1]))
    assert not verdicts.lied.any()
    print(f"{law} {name} {scenario}: {worst_velocity:.1e} {worst_cost:.1e}")
    tolerance = solver.tolerance
    assert worst_cost <= tolerance
    # A gradient r that is left over moves J v by sigma r / (sigma^2 + lambda^2) <= r / (2 lambda)
    # each way; alpha scaling has nothing that is so flat.
    assert worst_velocity <= tolerance * (2 / (2 * DAMPING) if law == "qp" else 1)
