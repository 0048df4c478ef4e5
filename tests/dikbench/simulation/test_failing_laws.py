"""Laws that go wrong: how they end a trial, and the status of a step."""

from __future__ import annotations

import re
from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import partial
from typing import Any, ClassVar

import numpy as np
import pinocchio as pin
import pytest
from makers.scenarios import at_step, exact, planar_scenario, raises, run_on_planar

from dikbench.arrays import Array
from dikbench.errors import Infeasible, SolverFailed
from dikbench.metrics import motion_of
from dikbench.plugins.building import make_formulation, make_plant, make_scenario
from dikbench.problem import DikProblem, Solve
from dikbench.programs.answer import Answer
from dikbench.programs.quadratic_program import ProgramKind, QuadraticProgram
from dikbench.scenario.reference.reference import target_at_rest
from dikbench.simulation.closed_loop import ERROR_CHECK_PERIOD_STEPS, simulate
from dikbench.simulation.status import STEP_CODE, Status
from dikbench.solvers.catalogue.back_ends import parse_solver
from dikbench.solvers.checked_solve import CheckedSolve, make_solve

# --- how laws end a trial


@pytest.mark.parametrize(
    ("wrong", "status", "message"),
    [
        (
            lambda: raises(ValueError("no\nsecond line")),
            "formulation-error",
            r"ValueError: no \(\w+\.py, line \d+\)$",
        ),
        (lambda: raises(KeyError("gain")), "formulation-error", r"KeyError: 'gain' \("),
        (lambda: raises(RuntimeError()), "formulation-error", "RuntimeError"),
        (lambda: np.linalg.inv(np.zeros((3, 3))), "formulation-error", "LinAlgError: Singular"),
        (lambda: raises(MemoryError()), "out-of-memory", ""),
        (lambda: np.zeros(2), "wrong-shape", r"expected \(3,\), got \(2,\)$"),
        (lambda: np.zeros((3, 1)), "wrong-shape", r"expected \(3,\), got \(3, 1\)$"),
        (lambda: np.float64(1.0), "wrong-shape", r"expected \(3,\), got \(\)$"),
        (lambda: [0.0, 0.0, 0.0], "wrong-shape", r"expected \(3,\), got list$"),
        (lambda: None, "wrong-shape", r"expected \(3,\), got NoneType$"),
        (lambda: np.array([None] * 3), "wrong-shape", r"object"),
        (lambda: np.array(["1"] * 3), "wrong-shape", r"<U1"),
        (lambda: np.array([1j, 0, 0]), "wrong-shape", r"complex128"),
        (lambda: np.array([0, np.nan, 0]), "not-finite", r"nan"),
        (lambda: np.array([0, 0, -np.inf]), "not-finite", r"-inf"),
        (lambda: np.array([0, 2e6, 0]), "diverged", r"commanded speed above 1e\+06 rad/s$"),
    ],
)
@pytest.mark.parametrize("k", [0, 7])
@pytest.mark.parametrize("mode", ["time", "path"])
def test_a_law_that_goes_wrong_ends_its_trial(
    wrong: Callable[[], Any], status: str, message: str, k: int, mode: str
) -> None:
    """With a status, the step and the reason on one line, and the steps before it in the trace."""
    run = run_on_planar(at_step(k, wrong), mode=mode)
    assert run.status.value == status
    assert re.search(rf"^step {k}: .*{message}", run.message)
    assert "\n" not in run.message
    assert run.trace.steps == k
    assert len(run.trace.q) == len(run.trace.tau) == k + 1
    assert np.isfinite(run.trace.q).all()
    assert np.all(run.trace.status == STEP_CODE[Status.OK])


@pytest.mark.parametrize("kind", [np.float32, np.int64])
def test_a_law_may_answer_in_other_numbers(kind: type) -> None:
    """Single precision and integers are numbers: the run goes on."""
    run = run_on_planar(lambda problem: np.array([0, 1, -1], dtype=kind))
    assert run.status is Status.OK
    assert run.trace.q[-1] == pytest.approx([0.4, 0.8 + 0.3, 0.7 - 0.3])


def test_a_motion_without_bounds_is_ended() -> None:
    """A target 200 m away is no task error that a law can be judged by."""
    scenario = planar_scenario()
    far = pin.SE3(np.eye(3), np.array([200.0, 0.0, 0.0]))
    run = run_on_planar(exact, replace(scenario, reference=target_at_rest(far, 0.3)))
    assert run.status is Status.DIVERGED
    assert run.message == "step 0: task error above 100 m, rad"
    assert run.trace.steps == 0


@pytest.mark.parametrize(
    "jump",
    [1, ERROR_CHECK_PERIOD_STEPS - 1, ERROR_CHECK_PERIOD_STEPS, ERROR_CHECK_PERIOD_STEPS + 1],
)
def test_a_target_that_runs_away_ends_a_run_at_the_next_look(jump: int) -> None:
    """The task error is looked at in one step out of so many, and then ends the run."""
    scenario = planar_scenario()
    far = pin.SE3(np.eye(3), np.array([200.0, 0.0, 0.0]))
    away = target_at_rest(far, 0.3)
    near = scenario.reference.placement

    def placement(tau: float) -> Any:
        return (away.placement if tau > (jump - 0.5) * scenario.dt else near)(tau)

    reference = replace(scenario.reference, placement=placement)
    run = run_on_planar(lambda problem: np.zeros(3), replace(scenario, reference=reference))
    step = (
        ERROR_CHECK_PERIOD_STEPS
        if jump <= ERROR_CHECK_PERIOD_STEPS
        else 2 * ERROR_CHECK_PERIOD_STEPS
    )
    if step < 30:
        assert run.status is Status.DIVERGED
        assert run.message == f"step {step}: task error above 100 m, rad"
        assert run.trace.steps == step
    else:
        assert run.status is Status.OK


@pytest.mark.parametrize(
    ("error", "status"),
    [
        (Infeasible("no point"), Status.INFEASIBLE),
        (SolverFailed("gave up"), Status.SOLVER_FAILED),
    ],
)
def test_a_law_without_an_answer_gets_the_fallback_and_goes_on(
    error: Exception, status: Status
) -> None:
    """One step with that status, in which the robot stops; the trial is ok."""
    run = run_on_planar(at_step(7, lambda: raises(error)))
    assert (run.status, run.message) == (Status.OK, "")
    assert run.trace.steps == 30
    assert np.flatnonzero(run.trace.status == STEP_CODE[status]).tolist() == [7]
    assert run.trace.share(status) == pytest.approx(1 / 30)
    assert np.all(run.trace.commanded[7] == 0)
    assert run.trace.q[8] == pytest.approx(run.trace.q[7])


def test_a_law_that_solves_without_saying_so_is_told() -> None:
    """The message of the trial says what to declare."""

    class Silent:
        def velocity(self, problem: DikProblem, solve: Solve) -> Array:
            return solve(QuadraticProgram(np.eye(3), np.zeros(3)))

    run = run_on_planar(Silent())
    assert run.status is Status.FORMULATION_ERROR
    assert "set program = 'qp' or 'lp'" in run.message


@dataclass(frozen=True)
class _Projection:
    """The velocity nearest to the exact one inside the limits, as a quadratic program."""

    program: ClassVar[ProgramKind] = "qp"

    def velocity(self, problem: DikProblem, solve: Solve) -> Array:
        """See `Formulation`."""
        box = problem.box()
        return solve(QuadraticProgram(np.eye(3), -exact(problem), lb=box.lower, ub=box.upper))


class _Liar:
    """A back end that claims every answer, and is 0.5 rad/s beside the right one at step 5."""

    def __init__(self) -> None:
        self.calls = 0

    def __call__(self, program: QuadraticProgram, site: int) -> Answer:
        assert program.lb is not None
        assert program.ub is not None
        self.calls += 1
        x = np.clip(-program.q, program.lb, program.ub)
        z_box = -program.q - x
        return Answer(x + (0.5 if self.calls == 6 else 0.0), True, z_box=z_box)


def test_a_lying_solver_is_caught_and_its_answer_applied() -> None:
    """`not-verified` at that step alone; its residual is in the trace, in rad/s."""
    run = run_on_planar(_Projection(), solve=CheckedSolve(_Liar()))
    assert run.status is Status.OK
    assert np.flatnonzero(run.trace.status).tolist() == [5]
    assert run.trace.status[5] == STEP_CODE[Status.NOT_VERIFIED]
    assert run.trace.dual[5] == pytest.approx(0.5)
    assert np.delete(run.trace.dual, 5).max() < 1e-12
    assert run.trace.claimed.tolist() == [1] * 30
    assert np.flatnonzero(run.trace.verified != 1).tolist() == [5]
    assert run.trace.verified[5] == 0


@dataclass(frozen=True)
class _Impossible:
    """x = 0 and x = 1, always."""

    program: ClassVar[ProgramKind] = "qp"

    def velocity(self, problem: DikProblem, solve: Solve) -> Array:
        """See `Formulation`."""
        A = np.array([[1.0, 0.0, 0.0], [1.0, 0.0, 0.0]])
        return solve(QuadraticProgram(np.eye(3), np.zeros(3), A=A, b=np.array([0.0, 1.0])))


@pytest.mark.parametrize("solver", ["daqp", "piqp", "proxqp"])
def test_an_infeasible_program_is_a_status_of_its_steps(solver: str) -> None:
    """Said by the solver: infeasible. Claimed solved by it: not verified. Nothing else."""
    run = run_on_planar(_Impossible(), solve=make_solve(parse_solver(solver), "qp"))
    assert run.status is Status.OK
    caught = run.trace.share(Status.INFEASIBLE) + run.trace.share(Status.NOT_VERIFIED)
    assert caught == pytest.approx(1.0)


def _a_share(share: float, problem: DikProblem) -> Array:
    return share * exact(problem)


def test_steps_that_go_nowhere_are_stuck() -> None:
    """Less than 1 % of the wanted motion; a hundredth and a bit is not."""
    for share, stuck in ((0.0099, 1.0), (0.0101, 0.0), (-0.5, 1.0)):
        run = run_on_planar(partial(_a_share, share))
        assert run.trace.share(Status.STUCK) == stuck


def test_a_run_that_is_given_up_keeps_its_torques() -> None:
    """No answer from the fastest part of the way on: the arm brakes within its torques."""
    scenario, steps = make_scenario("torque-limited[robot=ur5]"), 0

    class GivesUp:
        """Follows for a while."""

        def velocity(self, problem: DikProblem, solve: Solve) -> Array:
            """Return J^+ V, then nothing."""
            nonlocal steps
            steps += 1
            if steps > 20:
                raise SolverFailed("no answer")
            return make_formulation("pinv").velocity(problem, solve)

    run = simulate(scenario, GivesUp(), make_solve(None, None), make_plant("ideal"))
    motion = motion_of(run.trace, scenario)
    given_up = run.trace.status == STEP_CODE[Status.SOLVER_FAILED]
    assert given_up.sum() == run.trace.steps - 20
    assert np.abs(run.trace.applied[[19, 20]]).max(axis=1).min() > 0.1  # it cannot stop at once
    assert motion.torque_usage[given_up].max() <= 1 + 1e-6
    assert np.abs(run.trace.applied[-1]).max() < 1e-9
