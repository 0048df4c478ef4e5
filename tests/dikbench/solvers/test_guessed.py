"""Answers that need no solver: minimisers by the conditions of Karush, Kuhn and Tucker."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from dikbench.arrays import Array
from dikbench.programs.quadratic_program import QuadraticProgram
from dikbench.selector import parse_selector
from dikbench.solvers.catalogue.back_ends import parse_solver
from dikbench.solvers.checked_solve import make_solve
from dikbench.solvers.guessed import guessed
from dikbench.solvers.many_solve import ManySolve


def _least_squares(seed: int, count: int, bound: float) -> QuadraticProgram:
    """Damped least squares in a box, as `qp` poses them."""
    random = np.random.default_rng(seed)
    J, V = random.normal(size=(count, 6, 7)), random.normal(size=(count, 6))
    P = J.transpose(0, 2, 1) @ J + 1e-2 * np.eye(7)
    q = -np.einsum("kij,ki->kj", J, V)
    return QuadraticProgram(P, q, lb=np.full(7, -bound), ub=np.full((count, 7), bound))


def _alpha(seed: int, count: int, bound: float, rho: float) -> QuadraticProgram:
    """Alpha scaling, as `lp-alpha` poses it."""
    random, n = np.random.default_rng(seed), 7 if rho else 6
    A = random.normal(size=(count, 6, n + 1))
    P = np.zeros((n + 1, n + 1))
    P[range(n), range(n)] = rho
    upper = np.full((count, n + 1), bound)
    upper[:, n] = 1.0
    lower = -upper
    lower[:, n] = 0.0
    return QuadraticProgram(P, -np.eye(n + 1)[n], A=A, b=np.zeros(6), lb=lower, ub=upper)


def _part(program: QuadraticProgram, name: str, row: int, dimensions: int) -> Array:
    part = getattr(program, name)
    taken: Array = part[row] if part.ndim > dimensions else part
    return taken


@given(st.integers(0, 10**6), st.sampled_from([0.1, 0.5, 2.0, 20.0]))
def test_a_free_minimiser_is_taken_only_where_it_is_the_minimiser(seed: int, bound: float) -> None:
    """Against the solver, row by row: where a bound is active nothing is guessed."""
    program = _least_squares(seed, 8, bound)
    guess = guessed(program, 8)
    assert guess is not None
    for row in range(8):
        own = QuadraticProgram(
            _part(program, "P", row, 2), _part(program, "q", row, 1),
            lb=_part(program, "lb", row, 1), ub=_part(program, "ub", row, 1),
        )  # fmt: skip
        x = make_solve(parse_solver(parse_selector("daqp")), "qp")(own)
        inside = bool((np.abs(np.linalg.solve(own.P, -own.q)) <= bound).all())
        assert guess.minimal[row] == inside
        if inside:
            assert guess.x[row] == pytest.approx(x, abs=1e-9)
            assert max(guess.dual[row], guess.gap[row], guess.distance[row]) < 1e-9


@given(st.integers(0, 10**6), st.sampled_from([0.1, 1.0, 10.0]), st.sampled_from([0.0, 1e-4, 1.0]))
def test_the_whole_motion_is_taken_only_where_alpha_is_one(
    seed: int, bound: float, rho: float
) -> None:
    """Against the solver: inside the bounds, and where more of alpha is worth its cost."""
    program = _alpha(seed, 8, bound, rho)
    guess = guessed(program, 8)
    assert guess is not None
    solve = make_solve(
        parse_solver(parse_selector("highs" if rho == 0 else "clarabel[preset=high]")), "lp"
    )
    assert program.A is not None
    assert program.b is not None
    for row in np.flatnonzero(guess.minimal).tolist():
        own = QuadraticProgram(
            program.P, program.q, A=program.A[row], b=program.b,
            lb=_part(program, "lb", row, 1), ub=_part(program, "ub", row, 1),
        )  # fmt: skip
        x = solve(own)
        cost, best = (0.5 * y @ own.P @ y + own.q @ y for y in (guess.x[row], x))
        assert guess.x[row, -1] == 1.0
        assert cost == pytest.approx(best, abs=1e-6)
        assert np.abs(program.A[row] @ guess.x[row]).max() < 1e-9


def test_something_is_guessed_and_something_is_not() -> None:
    """So that the properties above are not about nothing."""
    for program in (_least_squares(1, 200, 0.7), _alpha(1, 200, 1.0, 1e-4), _alpha(1, 200, 1.0, 0)):
        guess = guessed(program, 200)
        assert guess is not None
        assert 20 < guess.minimal.sum() < 180


def test_rows_of_inequalities_and_singular_programs_are_left_to_the_solver() -> None:
    """G x <= h; P without an inverse; NaN."""
    program = _least_squares(0, 3, 1e3)
    rows = QuadraticProgram(program.P, program.q, np.eye(7), np.ones(7))
    assert guessed(rows, 3) is None
    P = program.P.copy()
    P[0], P[1, 2, 3] = 0.0, np.nan
    guess = guessed(QuadraticProgram(P, program.q, lb=program.lb, ub=program.ub), 3)
    assert guess is not None
    assert guess.minimal.tolist() == [False, False, True]


@pytest.mark.parametrize("guesses", [False, True])
def test_rows_are_solved_as_alone_and_rechecked(guesses: bool) -> None:
    """Every row is verified, and its record is that of the row alone."""
    program = _least_squares(3, 30, 0.7)
    solver = parse_solver(parse_selector("daqp"))
    many = ManySolve(guesses=guesses)
    many.begin_step([make_solve(solver, "qp") for _ in range(30)])
    x = many(program)
    assert many.rechecked is not None
    assert (many.rechecked.verified == 1).all()
    assert not many.rechecked.lied.any()
    for row in range(30):
        alone = make_solve(solver, "qp")
        own = QuadraticProgram(
            program.P[row], program.q[row],
            lb=_part(program, "lb", row, 1), ub=_part(program, "ub", row, 1),
        )  # fmt: skip
        assert x[row] == pytest.approx(alone(own), abs=1e-9)
        assert many.rechecked.claimed[row] == alone.rechecked().claimed[0] == 1


def test_a_row_without_an_answer_is_nan_and_not_claimed() -> None:
    """An infeasible program among others costs its own row."""
    program = _least_squares(3, 4, 0.7)
    assert program.lb is not None
    lower = np.tile(program.lb, (4, 1))
    lower[2] = 5.0
    solver = parse_solver(parse_selector("daqp"))
    many = ManySolve(guesses=True)
    many.begin_step([make_solve(solver, "qp") for _ in range(4)])
    x = many(QuadraticProgram(program.P, program.q, lb=lower, ub=program.ub))
    assert np.isfinite(x).all(axis=1).tolist() == [True, True, False, True]
    assert many.rechecked is not None
    assert many.rechecked.claimed.tolist() == [1, 1, 0, 1]
    assert many.rechecked.verified.tolist() == [1, 1, 0, 1]
