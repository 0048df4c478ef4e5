"""The solve that a law is handed: what it counts, what it believes, what it raises."""

from __future__ import annotations

import math

import numpy as np
import pytest

from dikbench.array import Array
from dikbench.errors import DikbenchError, Infeasible, SolverFailed
from dikbench.quadratic_program import QuadraticProgram
from dikbench.solvers.answer import Answer
from dikbench.solvers.catalogue import parse_solver
from dikbench.solvers.checked import CheckedSolve, NoSolve, make_solve
from dikbench.solvers.optimum import distance_to_optimum
from dikbench.solvers.residuals import residuals

# The libraries warn beside each failure; `dikbench.solvers` silences them, pytest resets that.
pytestmark = [
    pytest.mark.filterwarnings(r"ignore::UserWarning:qpsolvers\."),
    pytest.mark.filterwarnings(r"ignore::UserWarning:cvxpy\.|dikbench\.solvers\.modelled"),
]


def _scaling() -> tuple[QuadraticProgram, Array]:
    """The shape of alpha scaling: max alpha, v = alpha (1, 4), |v| <= 2: alpha = 1/2."""
    A = np.array([[1.0, 0.0, -1.0], [0.0, 1.0, -4.0]])
    bounds = {"lb": np.array([-2.0, -2.0, 0.0]), "ub": np.array([2.0, 2.0, 1.0])}
    program = QuadraticProgram(
        np.zeros((3, 3)), np.array([0.0, 0.0, -1.0]), A=A, b=np.zeros(2), **bounds
    )
    return program, np.array([0.5, 2.0, 0.5])


def _no_point() -> QuadraticProgram:
    """x_1 + x_2 = 3 with |x_i| <= 1."""
    A = np.array([[1.0, 1.0]])
    return QuadraticProgram(
        np.eye(2), np.zeros(2), A=A, b=np.array([3.0]), lb=-np.ones(2), ub=np.ones(2)
    )


def _one_bound() -> QuadraticProgram:
    """Min 1/2 x^2 - 2 x on [0, 1]: x = 1 with the multiplier 1 of the upper bound."""
    return QuadraticProgram(np.eye(1), np.array([-2.0]), lb=np.zeros(1), ub=np.ones(1))


class _Script:
    """A back end that reads its answers off a list."""

    def __init__(self, *answers: Answer) -> None:
        self.answers = list(answers)

    def __call__(self, program: object) -> Answer:
        return self.answers.pop(0)


def _said(x: float, multiplier: float | None = None, *, claimed: bool = True) -> Answer:
    z_box = None if multiplier is None else np.array([multiplier])
    return Answer(np.array([x]), claimed, z_box=z_box, core_ns=1000)


def test_counters_add_up_over_a_step_and_start_anew() -> None:
    """Calls and nanoseconds are sums, residuals the worst of the step, all forgotten after it."""
    solve = CheckedSolve(_Script(_said(1.0, 1.0), _said(1.25, 0.75), _said(1.0, 1.0)))
    solve(_one_bound())
    assert (solve.calls, solve.core_ns, solve.verified) == (1, 1000, True)
    solve(_one_bound())
    solve(_one_bound())
    assert (solve.calls, solve.core_ns) == (3, 3000)
    assert solve.primal == pytest.approx(0.25)
    assert solve.dual == pytest.approx(0.0)
    assert solve.gap == pytest.approx(abs(1.25 * -0.75 + 0.75))
    assert not solve.verified  # one lie in a step is enough
    assert solve.solve_ns > 0
    assert solve.checking_ns > 0
    solve.begin_step()
    assert (solve.calls, solve.solve_ns, solve.core_ns, solve.checking_ns) == (0, 0, 0, 0)
    assert (solve.primal, solve.dual, solve.gap) == (0.0, 0.0, 0.0)
    assert solve.verified


@pytest.mark.parametrize("unknown_first", [True, False])
def test_unknown_residuals_of_a_step_stay_unknown(unknown_first: bool) -> None:
    """A solver that gives no multipliers is not recorded as one without a dual residual."""
    answers = [_said(1.0), _said(1.0, 1.0)]
    solve = CheckedSolve(_Script(*(answers if unknown_first else answers[::-1])))
    solve(_one_bound())
    solve(_one_bound())
    assert math.isnan(solve.dual)
    assert math.isnan(solve.gap)
    assert solve.primal == 0.0
    assert solve.verified


def test_a_flat_cost_hides_nothing() -> None:
    """Half a rad/s beside the optimum where the gradient is 5e-5: the distance says so."""
    program = QuadraticProgram(np.diag([1.0, 1e-4]), np.array([-1.0, -1e-4]))
    beside = Answer(np.array([1.0, 1.5]), True)
    assert residuals(program, beside).verified
    solve = CheckedSolve(_Script(beside, Answer(np.array([1.0, 1.0]), True)))
    solve(program)
    assert solve.distance == pytest.approx(0.5)
    assert not solve.verified
    solve.begin_step()
    solve(program)
    assert solve.distance == pytest.approx(0.0, abs=1e-9)
    assert solve.verified


def test_the_distance_of_an_alpha_scaling_is_in_alpha() -> None:
    """Four fifths of the best alpha is 0.1 of 0.5 away, however far the velocities are."""
    program, x = _scaling()
    for share, distance in ((1.0, 0.0), (0.8, 0.1)):
        answer = Answer(share * x, True)
        assert distance_to_optimum(program, answer) == pytest.approx(distance, abs=1e-6)


def test_without_a_judge_the_distance_is_not_known() -> None:
    """A program without a feasible point has no optimum to be far from."""
    assert math.isnan(distance_to_optimum(_no_point(), Answer(np.ones(2), True)))


def test_a_lie_is_handed_out_and_recorded() -> None:
    """The law gets what the solver claimed; the record says that it is not verified."""
    solve = CheckedSolve(_Script(_said(7.0, 0.0)))
    assert solve(_one_bound()) == pytest.approx([7.0])
    assert solve.primal == pytest.approx(6.0)
    assert not solve.verified


def test_an_answer_that_is_not_claimed_is_not_handed_out() -> None:
    """However good it is: SolverFailed on a feasible program, Infeasible on the other."""
    solve = CheckedSolve(_Script(_said(1.0, 1.0, claimed=False), Answer(None, True)))
    with pytest.raises(SolverFailed, match="gave no answer to a feasible program"):
        solve(_one_bound())
    with pytest.raises(Infeasible, match="no feasible point"):
        solve(_no_point())
    assert solve.calls == 2
    assert solve.checking_ns > 0
    assert solve.verified  # nothing was claimed: nothing to be caught


def test_without_a_program_solving_is_an_error() -> None:
    """A law that declares none gets a solve that says what to declare."""
    for solve in (
        make_solve(None, None),
        make_solve(None, "qp"),
        make_solve(parse_solver("osqp"), None),
    ):
        assert isinstance(solve, NoSolve)
        with pytest.raises(DikbenchError, match="set program = 'qp' or 'lp'"):
            solve(_one_bound())
