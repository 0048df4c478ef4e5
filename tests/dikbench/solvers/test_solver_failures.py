"""Whatever a solver library does with a program that it cannot solve, it is one of two failures."""

from __future__ import annotations

import contextlib

import numpy as np
import pytest

from dikbench.errors import CannotAnswer, Infeasible, SolverFailed
from dikbench.programs.quadratic_program import QuadraticProgram
from dikbench.solvers.catalogue.back_ends import BACK_ENDS, is_installed, parse_solver
from dikbench.solvers.checked_solve import make_solve
from dikbench.solvers.recheck.feasibility import is_feasible

SELECTORS = [
    f"{name}[interface={interface}]"
    for name, back_end in BACK_ENDS.items()
    for interface in back_end.interfaces
    if is_installed(name)
]


@pytest.mark.parametrize("selector", SELECTORS)
def test_crossed_bounds_are_infeasible(selector: str) -> None:
    """A lower bound above its upper one is an infeasible program, not an error of the library."""
    n = 3
    program = QuadraticProgram(np.eye(n), np.ones(n), lb=np.ones(n), ub=-np.ones(n))
    with pytest.raises(Infeasible):
        make_solve(parse_solver(selector), "qp")(program)


@pytest.mark.parametrize("selector", SELECTORS)
def test_a_concave_cost_is_no_error_of_the_library(selector: str) -> None:
    """A concave cost, which no program of ours has, ends as an answer or as a failed step."""
    bound = np.ones(2)
    program = QuadraticProgram(np.diag([1.0, -1.0]), np.array([0.1, 0.0]), lb=-bound, ub=bound)
    with contextlib.suppress(CannotAnswer):
        make_solve(parse_solver(selector), "qp")(program)


@pytest.mark.parametrize("selector", SELECTORS)
def test_a_row_with_an_infinite_bound_is_solved_or_said_to_fail(selector: str) -> None:
    """With an infinite right side an answer is right, or not verified, or a failed step."""
    bound = np.array([1.0, 2.0])
    program = QuadraticProgram(
        np.eye(2),
        np.array([-3.0, -0.5]),
        G=np.array([[1.0, 1.0], [1.0, 0.0]]),
        h=np.array([np.inf, 0.25]),
        lb=-bound,
        ub=bound,
    )
    solve = make_solve(parse_solver(selector), "qp")
    try:
        x = solve(program)
    except SolverFailed:
        return
    if solve.rechecked().verified[0] == 1:
        np.testing.assert_allclose(x, [0.25, 0.5], atol=2e-2)


def test_the_judge_takes_infinite_right_sides() -> None:
    """A row with an infinite right side has no say in whether a program is feasible."""
    row, n = np.array([[1.0, 1.0]]), 2
    free = QuadraticProgram(np.eye(n), np.ones(n), G=row, h=np.array([np.inf]))
    shut = QuadraticProgram(
        np.eye(n),
        np.ones(n),
        G=np.vstack([row, row]),
        h=np.array([np.inf, -3.0]),
        lb=-np.ones(n),
        ub=np.ones(n),
    )
    assert is_feasible(free)
    assert not is_feasible(shut)
