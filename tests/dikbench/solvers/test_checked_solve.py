"""The solve that a law is handed: what it counts, what it believes, what it raises."""

from __future__ import annotations

import math

import numpy as np
import pytest
from makers.programs import (
    LIBRARIES_WARN,
    ScriptedSolver,
    ask,
    no_point,
    one_bound,
    said,
    scaling,
)

from dikbench.errors import DikbenchError, Infeasible, SolverFailed
from dikbench.programs.answer import Answer
from dikbench.programs.quadratic_program import QuadraticProgram
from dikbench.solvers import checked_solve
from dikbench.solvers.catalogue.back_ends import parse_solver
from dikbench.solvers.catalogue.presets import TOLERANCES
from dikbench.solvers.checked_solve import CheckedSolve, NoSolve, make_solve
from dikbench.solvers.recheck.optimum import PROVEN_DISTANCE, distance_to_optimum
from dikbench.solvers.recheck.residuals import residuals
from dikbench.solvers.recheck.stack import Stack

pytestmark = LIBRARIES_WARN


def test_counters_add_up_over_a_step_and_start_anew() -> None:
    """Calls and nanoseconds are sums, residuals the worst of the step, all forgotten after it."""
    script = ScriptedSolver(said(1.0, 1.0), said(1.25, 0.75), said(1.0, 1.0), said(1.0, 1.0))
    solve = CheckedSolve(script)
    solve.begin_run(3)
    solve.begin_step(0)
    solve(one_bound())
    assert (solve.calls, solve.core_ns) == (1, 1000)
    assert solve.rechecked().verified.tolist() == [1, -1, -1]
    solve(one_bound())
    solve(one_bound())
    assert (solve.calls, solve.core_ns) == (3, 3000)
    found = solve.rechecked()
    assert found.primal[0] == pytest.approx(0.25)
    assert found.dual[0] == pytest.approx(0.0)
    assert found.gap[0] == pytest.approx(abs(1.25 * -0.75 + 0.75))
    assert found.verified[0] == 0  # one lie in a step is enough
    assert found.claimed[0] == 1
    assert solve.solve_ns > 0
    assert solve.checking_ns == 0  # what was claimed is rechecked later
    solve.begin_step(1)
    assert (solve.calls, solve.solve_ns, solve.core_ns, solve.checking_ns) == (0, 0, 0, 0)
    solve.begin_step(2)
    solve(one_bound())
    assert script.sites == [0, 1, 2, 0]
    found = solve.rechecked()
    assert (found.primal[1], found.dual[1], found.gap[1], found.distance[1]) == (0.0,) * 4
    assert (found.primal[2], found.dual[2], found.gap[2]) == (0.0, 0.0, 0.0)
    assert found.verified.tolist() == [0, -1, 1]
    assert found.claimed.tolist() == [1, -1, 1]


def test_a_run_begins_with_nothing() -> None:
    """What was solved before it, rechecked or not, leaves no trace in it."""
    solve = CheckedSolve(ScriptedSolver(said(7.0, 0.0), said(7.0, 0.0), said(1.0, 1.0)))
    solve(one_bound())
    assert solve.rechecked().verified.tolist() == [0]
    solve(one_bound())
    solve.begin_run(2)
    solve.begin_step(0)
    solve(one_bound())
    found = solve.rechecked()
    assert (found.claimed.tolist(), found.verified.tolist()) == ([1, -1], [1, -1])
    assert found.primal.tolist() == [0.0, 0.0]


@pytest.mark.parametrize("unknown_first", [True, False])
def test_unknown_residuals_of_a_step_stay_unknown(unknown_first: bool) -> None:
    """A solver that gives no multipliers is not recorded as one without a dual residual."""
    answers = [said(1.0), said(1.0, 1.0)]
    solve = CheckedSolve(ScriptedSolver(*(answers if unknown_first else answers[::-1])))
    solve(one_bound())
    solve(one_bound())
    found = solve.rechecked()
    assert math.isnan(found.dual[0])
    assert math.isnan(found.gap[0])
    assert found.primal[0] == 0.0
    assert found.verified[0] == 1


def test_a_flat_cost_hides_nothing() -> None:
    """Half a rad/s beside the optimum where the gradient is 5e-5: the distance says so."""
    program = QuadraticProgram(np.diag([1.0, 1e-4]), np.array([-1.0, -1e-4]))
    beside = Answer(np.array([1.0, 1.5]), True)
    assert residuals(Stack([program], [beside])).within(TOLERANCES["default"])
    solve = CheckedSolve(ScriptedSolver(beside, Answer(np.array([1.0, 1.0]), True)))
    solve.begin_run(2)
    for step in range(2):
        solve.begin_step(step)
        solve(program)
    found = solve.rechecked()
    assert found.distance == pytest.approx([0.5, 0.0], abs=1e-9)
    assert found.verified.tolist() == [0, 1]


def _judged(program: QuadraticProgram, answer: Answer) -> float:
    """The distance that the judge finds, whatever the residuals prove."""
    return float(distance_to_optimum([program], [answer], np.full(1, np.inf))[0])


def test_the_distance_of_an_alpha_scaling_is_in_alpha() -> None:
    """Four fifths of the best alpha is 0.1 of 0.5 away, however far the velocities are."""
    program, x = scaling()
    for share, distance in ((1.0, 0.0), (0.8, 0.1)):
        answer = Answer(share * x, True)
        assert _judged(program, answer) == pytest.approx(distance, abs=1e-6)


def test_without_a_judge_the_distance_is_not_known() -> None:
    """A program without a feasible point has no optimum to be far from."""
    assert math.isnan(_judged(no_point(), Answer(np.ones(2), True)))


def test_the_judge_is_asked_where_nothing_is_proven() -> None:
    """A small bound is taken for the distance; a large one, however wrong, is replaced by it."""
    program, answer = one_bound(), said(0.75)
    bounds = np.array([0.0, 0.5 * PROVEN_DISTANCE, 2 * PROVEN_DISTANCE, 7.0, np.inf, np.nan])
    found = distance_to_optimum([program] * 6, [answer] * 6, bounds)
    assert found[:2].tolist() == bounds[:2].tolist()
    assert found[2:] == pytest.approx(0.25)


def test_a_lie_is_handed_out_and_recorded() -> None:
    """The law gets what the solver claimed; the record says that it is not verified."""
    solve = CheckedSolve(ScriptedSolver(said(7.0, 0.0)))
    assert solve(one_bound()) == pytest.approx([7.0])
    found = solve.rechecked()
    assert found.primal[0] == pytest.approx(6.0)
    assert found.verified[0] == 0


def test_an_answer_that_is_not_claimed_is_not_handed_out() -> None:
    """However good it is: SolverFailed on a feasible program, Infeasible on the other."""
    solve = CheckedSolve(ScriptedSolver(said(1.0, 1.0, claimed=False), Answer(None, False)))
    solve.begin_run(2)
    solve.begin_step(0)
    with pytest.raises(SolverFailed, match="gave no answer to a feasible program"):
        solve(one_bound())
    assert solve.checking_ns > 0
    solve.begin_step(1)
    with pytest.raises(Infeasible, match="no feasible point"):
        solve(no_point())
    assert solve.calls == 1
    assert solve.checking_ns > 0
    found = solve.rechecked()
    assert found.claimed.tolist() == [0, 0]  # nothing was claimed: nothing to be caught
    assert found.verified.tolist() == [1, 0]


NOT_A_NUMBER = float("nan")


@pytest.mark.parametrize(
    ("answer", "claimed", "verified"),
    [
        (said(1.0, 1.0), 1, 1),
        (said(1.0), 1, 1),  # without multipliers: by its violation and its distance alone
        (said(0.5, 0.0), 1, 0),  # a lie
        (said(0.5), 1, 0),
        (said(1.0, 1.0, claimed=False), 0, 1),  # too modest
        (said(7.0, 0.0, claimed=False), 0, 0),  # an honest failure
        (Answer(None, False), 0, 0),
        (Answer(None, True), 1, 0),  # a claim with nothing behind it
        (said(NOT_A_NUMBER, 1.0), 1, 0),
        (said(NOT_A_NUMBER), 1, 0),
        (said(float("inf"), 1.0), 1, 0),
        (said(NOT_A_NUMBER, claimed=False), 0, 0),
    ],
)
def test_what_is_claimed_and_what_is_verified(answer: Answer, claimed: int, verified: int) -> None:
    """Every pair of the two, beside steps at which nothing was solved (-1)."""
    solve = CheckedSolve(ScriptedSolver(answer, said(1.0, 1.0)))
    solve.begin_run(3)
    for step in (0, 2):
        solve.begin_step(step)
        ask(solve, one_bound())
    found = solve.rechecked()
    assert found.claimed.tolist() == [claimed, -1, 1]
    assert found.verified.tolist() == [verified, -1, 1]


def test_an_answer_that_is_not_finite_is_not_handed_out() -> None:
    """The law gets an exception, not a NaN."""
    for x in (NOT_A_NUMBER, float("inf")):
        with pytest.raises(SolverFailed, match="gave no answer"):
            CheckedSolve(ScriptedSolver(said(x, 1.0)))(one_bound())


@pytest.mark.parametrize("turn", range(4))
@pytest.mark.parametrize("batch", [1, 512])
def test_a_step_takes_the_worst_of_its_answers(
    monkeypatch: pytest.MonkeyPatch, turn: int, batch: int
) -> None:
    """Claimed if all are, verified if all are, the largest residual of each kind; in any order."""
    monkeypatch.setattr(checked_solve, "ANSWERS_PER_RECHECK", batch)
    answers = [
        (one_bound(), said(1.0, 1.0)),
        (one_bound(), said(0.5, 1.5)),  # gap 0.75, distance 0.5
        (one_bound(), said(1.25, 1.0)),  # violation 0.25, gradient 0.25
        (_two(), Answer(np.array([0.0, 3.0]), True, z_box=np.zeros(2))),  # of another structure
    ]
    answers = answers[turn:] + answers[:turn]
    answers[3] = answers[3][0], _unclaimed(answers[3][1])
    solve = CheckedSolve(ScriptedSolver(*(answer for _, answer in answers), said(1.0, 1.0)))
    solve.begin_run(2)
    solve.begin_step(0)
    for program, _ in answers:
        ask(solve, program)
    solve.begin_step(1)
    solve(one_bound())
    found = solve.rechecked()
    assert found.claimed.tolist() == [0, 1]
    assert found.verified.tolist() == [0, 1]
    assert found.primal == pytest.approx([2.0, 0.0])
    assert found.dual == pytest.approx([3.0, 0.0])
    assert found.gap == pytest.approx([9.0, 0.0])
    assert found.distance == pytest.approx([3.0, 0.0])


def _two() -> QuadraticProgram:
    """Min 1/2 |x|^2 with |x_i| <= 1."""
    return QuadraticProgram(np.eye(2), np.zeros(2), lb=-np.ones(2), ub=np.ones(2))


def _unclaimed(answer: Answer) -> Answer:
    return Answer(answer.x, False, answer.y, answer.z, answer.z_box)


def test_without_checks_nothing_is_kept() -> None:
    """The timing pass: answers are handed out as before, and there is no verdict."""
    solve = CheckedSolve(ScriptedSolver(said(7.0, 0.0), Answer(None, False)), checks=False)
    assert solve(one_bound()) == pytest.approx([7.0])
    with pytest.raises(SolverFailed):
        solve(no_point())
    found = solve.rechecked()
    assert (found.claimed.tolist(), found.verified.tolist()) == ([-1], [-1])


def test_the_tolerance_is_the_presets() -> None:
    """A violation between those of two presets is within one, and not within the other."""
    beside = said(1.0 + 1e-5, 1.0)
    for preset, verified in (("default", 1), ("low", 1), ("mid", 0), ("high", 0)):
        solver = parse_solver(f"osqp[preset={preset}]")
        solve = CheckedSolve(ScriptedSolver(beside), tolerance=solver.tolerance)
        solve(one_bound())
        assert solve.rechecked().verified.tolist() == [verified]


def test_without_a_program_solving_is_an_error() -> None:
    """A law that declares none gets a solve that says what to declare."""
    for solve in (
        make_solve(None, None),
        make_solve(None, "qp"),
        make_solve(parse_solver("osqp"), None),
    ):
        assert isinstance(solve, NoSolve)
        with pytest.raises(DikbenchError, match="set program = 'qp' or 'lp'"):
            solve(one_bound())
