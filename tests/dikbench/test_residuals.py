"""Residuals of answers, recomputed by hand."""

from __future__ import annotations

import math

import numpy as np
import pytest

from dikbench.array import Array
from dikbench.quadratic_program import QuadraticProgram
from dikbench.solvers.answer import Answer
from dikbench.solvers.residuals import VERIFIED_TOLERANCE, residuals

# The libraries warn beside each failure; `dikbench.solvers` silences them, pytest resets that.
pytestmark = [
    pytest.mark.filterwarnings(r"ignore::UserWarning:qpsolvers\."),
    pytest.mark.filterwarnings(r"ignore::UserWarning:cvxpy\.|dikbench\.solvers\.modelled"),
]


def _mixture() -> tuple[QuadraticProgram, Array]:
    """Everything at once, the optimum put together from its multipliers.

    x = (1, 0, 0.5): the upper bound of x_1 active (multiplier 2), the lower one of x_2 (-3), the
    inequality x_1 + x_3 <= 1.5 active (0.5) and x_1 + x_2 - x_3 = 0.5 (-1), so that
    q = -(P x + G'z + A'y + w).
    """
    P, x = np.diag([1.0, 2.0, 4.0]), np.array([1.0, 0.0, 0.5])
    G, A = np.array([[1.0, 0.0, 1.0]]), np.array([[1.0, 1.0, -1.0]])
    q = -(P @ x + G.T @ [0.5] + A.T @ [-1.0] + np.array([2.0, -3.0, 0.0]))
    bounds = {"lb": np.array([-1.0, 0.0, -1.0]), "ub": np.array([1.0, 1.0, 1.0])}
    return QuadraticProgram(P, q, G, np.array([1.5]), A, np.array([0.5]), **bounds), x


def test_residuals_of_the_right_answer_are_zero() -> None:
    """The optimum that was put together from its multipliers, with these multipliers."""
    program, x = _mixture()
    answer = Answer(
        x, True, y=np.array([-1.0]), z=np.array([0.5]), z_box=np.array([2.0, -3.0, 0.0])
    )
    found = residuals(program, answer)
    assert found.primal == pytest.approx(0.0, abs=1e-15)
    assert found.dual == pytest.approx(0.0, abs=1e-15)
    assert found.gap == pytest.approx(0.0, abs=1e-15)
    assert found.verified


@pytest.mark.parametrize(
    ("x", "primal"),
    [
        ([1.0, 0.0, 0.5], 0.0),
        ([1.25, 0.0, 0.25], 0.5),  # the equality by 0.5, the bound by 0.25
        ([1.0, -0.75, -0.25], 0.75),  # the lower bound
        ([1.0, 0.5, 1.0], 0.5),  # the inequality
        ([2.0, 0.0, 1.5], 2.0),  # the inequality by 2, bounds by 1 and 0.5
    ],
)
def test_the_primal_residual_is_the_worst_violation(x: list[float], primal: float) -> None:
    """Of equalities, inequalities and bounds alike."""
    program, _ = _mixture()
    answer = Answer(np.array(x), True, np.zeros(1), np.zeros(1), np.zeros(3))
    assert residuals(program, answer).primal == pytest.approx(primal)


def _one_bound() -> QuadraticProgram:
    """Min 1/2 x^2 - 2 x on [0, 1]: x = 1 with the multiplier 1 of the upper bound."""
    return QuadraticProgram(np.eye(1), np.array([-2.0]), lb=np.zeros(1), ub=np.ones(1))


@pytest.mark.parametrize(
    ("x", "multiplier", "dual", "gap"),
    [
        (1.0, 1.0, 0.0, 0.0),
        (1.0, -1.0, 2.0, 1.0),  # wrong sign: gradient 1 - 2 - 1; gap 1*(1 - 2) + 0*(-1)
        (1.0, 0.0, 1.0, 1.0),  # no multiplier: gradient 1 - 2
        (0.5, 1.5, 0.0, 0.75),  # stationary but not complementary: -0.75 + 1.5
    ],
)
def test_dual_residual_and_gap_of_a_bound(
    x: float, multiplier: float, dual: float, gap: float
) -> None:
    """By hand: |x - 2 + z| and |x (x - 2) + ub z+ + lb z-|."""
    found = residuals(_one_bound(), Answer(np.array([x]), True, z_box=np.array([multiplier])))
    assert found.dual == pytest.approx(dual)
    assert found.gap == pytest.approx(gap)
    assert found.verified == (dual == gap == 0.0)


def test_a_negative_multiplier_of_an_inequality_is_a_dual_residual() -> None:
    """-x <= 0 with min 1/2 x^2 - x: stationary at x = 0 with z = -1, which pulls, not pushes."""
    program = QuadraticProgram(np.eye(1), np.array([-1.0]), -np.eye(1), np.zeros(1))
    found = residuals(program, Answer(np.zeros(1), True, z=np.array([-1.0])))
    assert found.primal == 0
    assert found.dual == pytest.approx(1.0)
    assert not found.verified


@pytest.mark.parametrize("sign", [1, -1])
def test_a_multiplier_of_an_infinite_bound_is_a_dual_residual(sign: int) -> None:
    """Stationary through a bound that does not exist: caught, and nothing becomes NaN."""
    inf = np.array([np.inf])
    program = QuadraticProgram(np.eye(1), np.array([-2.0 * sign]), lb=-inf, ub=inf)
    found = residuals(program, Answer(np.zeros(1), True, z_box=np.array([2.0 * sign])))
    assert found.dual == pytest.approx(2.0)
    assert found.gap == 0.0
    right = residuals(program, Answer(np.array([2.0 * sign]), True, z_box=np.zeros(1)))
    assert (right.primal, right.dual, right.gap) == (0.0, 0.0, 0.0)


def test_an_infinite_side_of_an_inequality_does_not_count() -> None:
    """It constrains nothing, and inf times zero is no NaN in the gap."""
    program = QuadraticProgram(
        np.eye(1), np.array([-2.0]), np.ones((2, 1)), np.array([np.inf, 1.0])
    )
    found = residuals(program, Answer(np.ones(1), True, z=np.array([0.0, 1.0])))
    assert (found.primal, found.dual, found.gap) == (0.0, 0.0, 0.0)


def test_dual_residuals_are_relative_to_the_cost() -> None:
    """A cost 100 times as large has a gradient 100 times as large for the same error in x."""
    small, large = (
        residuals(
            QuadraticProgram(scale * np.eye(1), np.array([-scale]), lb=-np.ones(1), ub=np.ones(1)),
            Answer(np.array([0.5]), True, z_box=np.zeros(1)),
        )
        for scale in (1.0, 100.0)
    )
    assert small.dual == pytest.approx(0.5)
    assert large.dual == pytest.approx(small.dual)
    assert large.gap == pytest.approx(small.gap)


def test_unknown_multipliers_leave_the_dual_unknown() -> None:
    """NaN, and the verdict rests on the primal residual alone."""
    found = residuals(_one_bound(), Answer(np.array([1.0]), True))
    assert found.primal == 0.0
    assert math.isnan(found.dual)
    assert math.isnan(found.gap)
    assert found.verified
    assert not residuals(_one_bound(), Answer(np.array([1.1]), True)).verified


@pytest.mark.parametrize("excess", [0.5, 2.0])
def test_the_tolerance_of_verification(excess: float) -> None:
    """At most VERIFIED_TOLERANCE of violation is accepted."""
    x = np.array([1.0 + excess * VERIFIED_TOLERANCE])
    assert residuals(_one_bound(), Answer(x, True)).verified == (excess < 1)


# --- the checked call
