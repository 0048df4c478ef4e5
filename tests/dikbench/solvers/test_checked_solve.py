"""The solve that a law is handed: what it counts, what it believes, what it raises."""

from __future__ import annotations

import contextlib
import math
from typing import Any

import numpy as np
import pytest
from makers.programs import LIBRARIES_WARN, no_point, scaling

from dikbench.errors import CannotAnswer, DikbenchError, Infeasible, SolverFailed
from dikbench.programs.answer import Answer
from dikbench.programs.quadratic_program import QuadraticProgram
from dikbench.solvers import checked_solve
from dikbench.solvers.catalogue.back_ends import parse_solver
from dikbench.solvers.catalogue.presets import TOLERANCES
from dikbench.solvers.checked_solve import CheckedSolve, NoSolve, make_solve
from dikbench.solvers.interfaces.cold import ColdSolver
from dikbench.solvers.recheck.optimum import JUDGE_SOLVER, PROVEN_DISTANCE, distance_to_optimum
from dikbench.solvers.recheck.rechecked import RecheckedSteps
from dikbench.solvers.recheck.residuals import residuals
from dikbench.solvers.recheck.stack import Stack

pytestmark = LIBRARIES_WARN


def _one_bound() -> QuadraticProgram:
    """Min 1/2 x^2 - 2 x on [0, 1]: x = 1 with the multiplier 1 of the upper bound."""
    return QuadraticProgram(np.eye(1), np.array([-2.0]), lb=np.zeros(1), ub=np.ones(1))


class _Script:
    """A back end that reads its answers off a list, and notes from which call they were asked."""

    def __init__(self, *answers: Answer) -> None:
        self.answers = list(answers)
        self.sites: list[int] = []

    def __call__(self, program: object, site: int) -> Answer:
        self.sites.append(site)
        return self.answers.pop(0)


def _said(x: float, multiplier: float | None = None, *, claimed: bool = True) -> Answer:
    z_box = None if multiplier is None else np.array([multiplier])
    return Answer(np.array([x]), claimed, z_box=z_box, core_ns=1000)


def test_counters_add_up_over_a_step_and_start_anew() -> None:
    """Calls and nanoseconds are sums, residuals the worst of the step, all forgotten after it."""
    script = _Script(_said(1.0, 1.0), _said(1.25, 0.75), _said(1.0, 1.0), _said(1.0, 1.0))
    solve = CheckedSolve(script)
    solve.begin_run(3)
    solve.begin_step(0)
    solve(_one_bound())
    assert (solve.calls, solve.core_ns) == (1, 1000)
    assert solve.rechecked().verified.tolist() == [1, -1, -1]
    solve(_one_bound())
    solve(_one_bound())
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
    solve(_one_bound())
    assert script.sites == [0, 1, 2, 0]
    found = solve.rechecked()
    assert (found.primal[1], found.dual[1], found.gap[1], found.distance[1]) == (0.0,) * 4
    assert (found.primal[2], found.dual[2], found.gap[2]) == (0.0, 0.0, 0.0)
    assert found.verified.tolist() == [0, -1, 1]
    assert found.claimed.tolist() == [1, -1, 1]


def test_a_run_begins_with_nothing() -> None:
    """What was solved before it, rechecked or not, leaves no trace in it."""
    solve = CheckedSolve(_Script(_said(7.0, 0.0), _said(7.0, 0.0), _said(1.0, 1.0)))
    solve(_one_bound())
    assert solve.rechecked().verified.tolist() == [0]
    solve(_one_bound())
    solve.begin_run(2)
    solve.begin_step(0)
    solve(_one_bound())
    found = solve.rechecked()
    assert (found.claimed.tolist(), found.verified.tolist()) == ([1, -1], [1, -1])
    assert found.primal.tolist() == [0.0, 0.0]


@pytest.mark.parametrize("unknown_first", [True, False])
def test_unknown_residuals_of_a_step_stay_unknown(unknown_first: bool) -> None:
    """A solver that gives no multipliers is not recorded as one without a dual residual."""
    answers = [_said(1.0), _said(1.0, 1.0)]
    solve = CheckedSolve(_Script(*(answers if unknown_first else answers[::-1])))
    solve(_one_bound())
    solve(_one_bound())
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
    solve = CheckedSolve(_Script(beside, Answer(np.array([1.0, 1.0]), True)))
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
    program, answer = _one_bound(), _said(0.75)
    bounds = np.array([0.0, 0.5 * PROVEN_DISTANCE, 2 * PROVEN_DISTANCE, 7.0, np.inf, np.nan])
    found = distance_to_optimum([program] * 6, [answer] * 6, bounds)
    assert found[:2].tolist() == bounds[:2].tolist()
    assert found[2:] == pytest.approx(0.25)


def test_a_lie_is_handed_out_and_recorded() -> None:
    """The law gets what the solver claimed; the record says that it is not verified."""
    solve = CheckedSolve(_Script(_said(7.0, 0.0)))
    assert solve(_one_bound()) == pytest.approx([7.0])
    found = solve.rechecked()
    assert found.primal[0] == pytest.approx(6.0)
    assert found.verified[0] == 0


def test_an_answer_that_is_not_claimed_is_not_handed_out() -> None:
    """However good it is: SolverFailed on a feasible program, Infeasible on the other."""
    solve = CheckedSolve(_Script(_said(1.0, 1.0, claimed=False), Answer(None, False)))
    solve.begin_run(2)
    solve.begin_step(0)
    with pytest.raises(SolverFailed, match="gave no answer to a feasible program"):
        solve(_one_bound())
    assert solve.checking_ns > 0
    solve.begin_step(1)
    with pytest.raises(Infeasible, match="no feasible point"):
        solve(no_point())
    assert solve.calls == 1
    assert solve.checking_ns > 0
    found = solve.rechecked()
    assert found.claimed.tolist() == [0, 0]  # nothing was claimed: nothing to be caught
    assert found.verified.tolist() == [1, 0]


def _ask(solve: CheckedSolve, program: QuadraticProgram) -> None:
    with contextlib.suppress(CannotAnswer):
        solve(program)


NOT_A_NUMBER = float("nan")


@pytest.mark.parametrize(
    ("answer", "claimed", "verified"),
    [
        (_said(1.0, 1.0), 1, 1),
        (_said(1.0), 1, 1),  # without multipliers: by its violation and its distance alone
        (_said(0.5, 0.0), 1, 0),  # a lie
        (_said(0.5), 1, 0),
        (_said(1.0, 1.0, claimed=False), 0, 1),  # too modest
        (_said(7.0, 0.0, claimed=False), 0, 0),  # an honest failure
        (Answer(None, False), 0, 0),
        (Answer(None, True), 1, 0),  # a claim with nothing behind it
        (_said(NOT_A_NUMBER, 1.0), 1, 0),
        (_said(NOT_A_NUMBER), 1, 0),
        (_said(float("inf"), 1.0), 1, 0),
        (_said(NOT_A_NUMBER, claimed=False), 0, 0),
    ],
)
def test_what_is_claimed_and_what_is_verified(answer: Answer, claimed: int, verified: int) -> None:
    """Every pair of the two, beside steps at which nothing was solved (-1)."""
    solve = CheckedSolve(_Script(answer, _said(1.0, 1.0)))
    solve.begin_run(3)
    for step in (0, 2):
        solve.begin_step(step)
        _ask(solve, _one_bound())
    found = solve.rechecked()
    assert found.claimed.tolist() == [claimed, -1, 1]
    assert found.verified.tolist() == [verified, -1, 1]


def test_an_answer_that_is_not_finite_is_not_handed_out() -> None:
    """The law gets an exception, not a NaN."""
    for x in (NOT_A_NUMBER, float("inf")):
        with pytest.raises(SolverFailed, match="gave no answer"):
            CheckedSolve(_Script(_said(x, 1.0)))(_one_bound())


@pytest.mark.parametrize("turn", range(4))
@pytest.mark.parametrize("batch", [1, 512])
def test_a_step_takes_the_worst_of_its_answers(
    monkeypatch: pytest.MonkeyPatch, turn: int, batch: int
) -> None:
    """Claimed if all are, verified if all are, the largest residual of each kind; in any order."""
    monkeypatch.setattr(checked_solve, "ANSWERS_PER_RECHECK", batch)
    answers = [
        (_one_bound(), _said(1.0, 1.0)),
        (_one_bound(), _said(0.5, 1.5)),  # gap 0.75, distance 0.5
        (_one_bound(), _said(1.25, 1.0)),  # violation 0.25, gradient 0.25
        (_two(), Answer(np.array([0.0, 3.0]), True, z_box=np.zeros(2))),  # of another structure
    ]
    answers = answers[turn:] + answers[:turn]
    answers[3] = answers[3][0], _unclaimed(answers[3][1])
    solve = CheckedSolve(_Script(*(answer for _, answer in answers), _said(1.0, 1.0)))
    solve.begin_run(2)
    solve.begin_step(0)
    for program, _ in answers:
        _ask(solve, program)
    solve.begin_step(1)
    solve(_one_bound())
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


def _program(random: np.random.Generator, n: int, kind: int) -> QuadraticProgram:
    """A program with a feasible point (zero) of one of a few structures."""
    root = random.normal(size=(n, n))
    P = root @ root.T + 0.1 * np.eye(n) if kind else np.zeros((n, n))
    G, h = (random.normal(size=(2, n)), np.ones(2)) if kind == 2 else (None, None)
    A, b = (random.normal(size=(1, n)), np.zeros(1)) if kind == 3 else (None, None)
    bound = random.uniform(0.1, 1.0, n)
    return QuadraticProgram(P, random.normal(size=n), G, h, A, b, -bound, bound)


def _run(seed: int, steps: int = 25) -> RecheckedSteps:
    """What is found on a run of up to four answers per step: right, wrong, none, unexplained."""
    random = np.random.default_rng(seed)
    exact = ColdSolver(JUDGE_SOLVER)
    script = _Script()
    solve = CheckedSolve(script, tolerance=1e-6)
    solve.begin_run(steps)
    for step in range(steps):
        solve.begin_step(step)
        for _ in range(random.integers(0, 5)):
            program = _program(random, int(random.integers(2, 5)), int(random.integers(0, 4)))
            answer = exact(program)
            assert answer.x is not None
            answer.claimed = bool(random.random() < 0.9)
            fate = random.random()
            if fate < 0.3:
                answer.x = answer.x + 10.0 ** random.uniform(-9, 0) * random.normal(
                    size=len(answer.x)
                )
            elif fate < 0.35:
                answer.x = None
            elif fate < 0.4:
                answer.x = np.full(len(program.q), np.nan)
            elif fate < 0.5:
                answer.z_box = None
            script.answers.append(answer)
            _ask(solve, program)
    return solve.rechecked()


@pytest.mark.parametrize("seed", range(4))
def test_what_is_found_does_not_depend_on_when_it_is_looked_for(
    monkeypatch: pytest.MonkeyPatch, seed: int
) -> None:
    """Step by step, in small batches, or all at the end; but for the part of proven distances."""
    found = {}
    for batch in (1, 3, 512):
        monkeypatch.setattr(checked_solve, "ANSWERS_PER_RECHECK", batch)
        found[batch] = _run(seed)
    last = found[512]
    assert {-1, 0, 1} == set(last.claimed.tolist()) == set(last.verified.tolist())
    assert not np.array_equal(last.claimed, last.verified)
    for batch in (1, 3):
        assert found[batch].claimed.tolist() == last.claimed.tolist()
        assert found[batch].verified.tolist() == last.verified.tolist()
        for part in ("primal", "dual", "gap"):
            one, other = getattr(found[batch], part), getattr(last, part)
            np.testing.assert_allclose(one, other, rtol=1e-9, atol=1e-13, equal_nan=True)
        # A bound that is proof enough stands for the distance, and is that of its batch.
        np.testing.assert_allclose(
            found[batch].distance, last.distance, rtol=1e-9, atol=PROVEN_DISTANCE, equal_nan=True
        )


def test_the_recheck_keeps_to_its_batches(monkeypatch: pytest.MonkeyPatch) -> None:
    """No more than so many answers wait, and whole steps are rechecked."""
    waiting: list[int] = []

    def note(verdicts: RecheckedSteps, solved: list[Any], tolerance: float) -> None:
        waiting.append(len(solved))

    monkeypatch.setattr(RecheckedSteps, "recheck", note)
    monkeypatch.setattr(checked_solve, "ANSWERS_PER_RECHECK", 3)
    solve = CheckedSolve(_Script(*(_said(1.0, 1.0) for _ in range(10))))
    solve.begin_run(5)
    for step in range(5):
        solve.begin_step(step)
        solve(_one_bound())
        solve(_one_bound())
    solve.rechecked()
    assert waiting == [4, 4, 2]


def test_without_checks_nothing_is_kept() -> None:
    """The timing pass: answers are handed out as before, and there is no verdict."""
    solve = CheckedSolve(_Script(_said(7.0, 0.0), Answer(None, False)), checks=False)
    assert solve(_one_bound()) == pytest.approx([7.0])
    with pytest.raises(SolverFailed):
        solve(no_point())
    found = solve.rechecked()
    assert (found.claimed.tolist(), found.verified.tolist()) == ([-1], [-1])


def test_the_tolerance_is_the_presets() -> None:
    """A violation between those of two presets is within one, and not within the other."""
    beside = _said(1.0 + 1e-5, 1.0)
    for preset, verified in (("default", 1), ("low", 1), ("mid", 0), ("high", 0)):
        solver = parse_solver(f"osqp[preset={preset}]")
        solve = CheckedSolve(_Script(beside), tolerance=solver.tolerance)
        solve(_one_bound())
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
            solve(_one_bound())
