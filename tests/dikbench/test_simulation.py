"""The closed loop: how long it runs, what plants make of a command, how laws end a trial."""

from __future__ import annotations

import io
import re
import zipfile
from collections.abc import Callable
from dataclasses import dataclass, fields, replace
from pathlib import Path
from typing import Any, ClassVar

import numpy as np
import pinocchio as pin
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from dikbench.array import Array
from dikbench.certificate import Certificate
from dikbench.control_step import fallback
from dikbench.errors import Infeasible, SolverFailed
from dikbench.limits import Limits
from dikbench.plants import PLANTS, Plant, ideal, saturating
from dikbench.problem import DikProblem, Formulation, Solve
from dikbench.quadratic_program import Program, QuadraticProgram
from dikbench.references import joint_path, target_at_rest
from dikbench.registry import make_formulation, make_scenario
from dikbench.robot_catalogue import load_robot
from dikbench.scenario import Scenario
from dikbench.simulation import LONGEST, Run, simulate
from dikbench.solvers.answer import Answer
from dikbench.solvers.catalogue import parse_solver
from dikbench.solvers.checked import CheckedSolve, make_solve
from dikbench.status import STEP_CODE, Status
from dikbench.tasks import PostureTask
from dikbench.trace import Trace

RATE = np.array([0.5, -0.4, 0.6])


def _scenario(
    *, dt: float = 0.01, duration: float = 0.3, rate: Array = RATE, **limits: Any
) -> Scenario:
    """A planar arm that is to follow the pose of q0 + t rate, from its own velocity on."""
    robot = load_robot("planar3r").with_limits(**limits)
    q0 = np.array([0.4, 0.8, 0.7])
    return Scenario(
        robot=robot,
        q0=q0,
        v0=rate.copy(),
        reference=joint_path(robot, lambda tau: q0 + tau * rate, lambda tau: rate, duration),
        gain=2.0,
        dt=dt,
        duration=duration,
        certificate=Certificate(()),
    )


class _Law:
    """A law made of a function of the problem; it keeps the problems that it saw."""

    def __init__(self, velocity: Callable[[DikProblem], Any]) -> None:
        self.answer = velocity
        self.seen: list[DikProblem] = []

    def velocity(self, problem: DikProblem, solve: Solve) -> Any:
        self.seen.append(problem)
        return self.answer(problem)


def _exact(problem: DikProblem) -> Array:
    """The velocity that does the task."""
    v: Array = np.linalg.solve(problem.primary.J, problem.primary.V)
    return v


def _run(
    law: Formulation | Callable[[DikProblem], Any],
    scenario: Scenario | None = None,
    *,
    plant: Plant = ideal,
    mode: Any = "time",
    solve: CheckedSolve | None = None,
) -> Run:
    formulation = law if isinstance(law, Formulation) else _Law(law)
    chosen = make_solve(None, None) if solve is None else solve
    return simulate(scenario or _scenario(), formulation, chosen, plant, mode)


# --- how long a run is


@pytest.mark.parametrize(
    ("duration", "dt", "steps"),
    [(0.3, 0.01, 30), (0.3, 0.007, 43), (0.07, 0.05, 1), (0.01, 0.01, 1)],
)
def test_a_time_indexed_run_lasts_as_long_as_its_scenario(
    duration: float, dt: float, steps: int
) -> None:
    """duration/dt steps, rounded; one more configuration than steps; tau is the clock."""
    run = _run(_exact, _scenario(duration=duration, dt=dt))
    assert (run.status, run.message) == (Status.OK, "")
    assert run.trace.steps == steps
    assert run.trace.q.shape == (steps + 1, 3)
    assert run.trace.tau == pytest.approx(dt * np.arange(steps + 1))
    for name in ("wanted", "commanded", "applied", "status", "relaxed", "primal", "dual", "gap"):
        assert len(getattr(run.trace, name)) == steps


def test_a_path_indexed_run_ends_with_the_path() -> None:
    """A law that does all that is wanted needs the nominal time."""
    run = _run(_exact, mode="path")
    assert run.status is Status.OK
    assert run.trace.steps in {30, 31}
    assert run.trace.tau[-1] == pytest.approx(0.3)
    assert np.all(np.diff(run.trace.tau) >= 0)


@pytest.mark.parametrize("share", [0.5, 0.25])
def test_a_path_indexed_reference_waits_for_a_slow_law(share: float) -> None:
    """At a share of the speed it moves on by that share, and takes as much longer."""
    run = _run(lambda problem: share * _exact(problem), mode="path")
    assert run.trace.steps == pytest.approx(30 / share, abs=2)
    assert np.diff(run.trace.tau) == pytest.approx(0.01 * share)


def test_a_path_indexed_reference_does_not_run_ahead_or_back() -> None:
    """Twice the wanted speed is full progress, a reversal is none."""
    fast = _run(lambda problem: 2 * _exact(problem), mode="path")
    assert np.diff(fast.trace.tau) == pytest.approx(0.01)
    back = _run(lambda problem: -0.01 * _exact(problem), mode="path")
    assert np.all(back.trace.tau == 0)


def test_a_path_indexed_run_gives_up_after_five_times_its_duration() -> None:
    """A law that stands still is not waited for for ever; the trial is ok, its steps are stuck."""
    run = _run(lambda problem: np.zeros(3), mode="path")
    assert LONGEST == 5
    assert run.status is Status.OK
    assert run.trace.steps == 150
    assert np.all(run.trace.tau == 0)
    assert run.trace.share(Status.STUCK) == 1.0


def test_a_path_indexed_run_of_a_target_at_rest_moves_on_when_there() -> None:
    """A dwell has no progress to wait for: the clock moves on."""
    scenario = _scenario(rate=np.zeros(3))
    run = _run(_exact, scenario, mode="path")
    assert run.trace.steps in {30, 31}
    assert np.all(run.trace.status == STEP_CODE[Status.OK])


# --- what a law sees


def test_a_law_sees_the_state_that_it_made() -> None:
    """The integral of what was applied, what was applied last, and the period."""
    law = _Law(lambda problem: 3 * _exact(problem))
    scenario = _scenario(velocity=1.0)
    run = _run(law, scenario, plant=saturating)
    assert np.array_equal(law.seen[0].q, scenario.q0)
    assert np.array_equal(law.seen[0].v_prev, scenario.v0)
    clipped = 0
    for k in range(1, 30):
        assert np.array_equal(law.seen[k].q, run.trace.q[k])
        assert np.array_equal(law.seen[k].v_prev, run.trace.applied[k - 1])
        assert run.trace.q[k] == pytest.approx(run.trace.q[k - 1] + 0.01 * run.trace.applied[k - 1])
        assert law.seen[k].dt == 0.01
        clipped += not np.array_equal(run.trace.commanded[k], run.trace.applied[k])
    assert clipped > 10  # else the command would do as well


def test_a_law_sees_limits_and_tasks_of_its_configuration() -> None:
    """Distances to the limits at q, the tracking task first, secondary tasks after it."""
    scenario = _scenario()
    scenario = replace(scenario, tasks=(PostureTask(target=scenario.q0, gain=1.0),))
    law = _Law(_exact)
    _run(law, scenario)
    upper = 2.8
    for problem in law.seen:
        assert problem.limits.to_upper == pytest.approx(upper - problem.q)
        assert problem.tasks[1].error == pytest.approx(scenario.q0 - problem.q)
        assert [task.priority for task in problem.tasks] == [1, 2]
        assert problem.primary is problem.tasks[0]


def test_feed_forward_and_gain_hold_the_reference() -> None:
    """The exact law stays on a reference that it started on (to second order in dt)."""
    for dt, error in ((0.01, 1e-4), (0.001, 1e-6)):
        run = _run(_exact, _scenario(dt=dt))
        expected = np.array([0.4, 0.8, 0.7]) + run.trace.tau[:, None] * RATE
        assert np.abs(run.trace.q - expected).max() < error


def test_a_scenario_survives_its_runs() -> None:
    """It is made once and run by every law: start, velocity and robot stay as they are."""
    scenario = _scenario()
    before = scenario.q0.copy(), scenario.v0.copy(), scenario.robot.q0.copy()
    _run(lambda problem: 3 * _exact(problem), scenario)
    _run(lambda problem: np.full(3, 1e9), scenario)
    after = scenario.q0, scenario.v0, scenario.robot.q0
    for a, b in zip(before, after, strict=True):
        assert np.array_equal(a, b)


# --- plants


def _beyond(run: Run, scenario: Scenario) -> tuple[float, float]:
    """Largest violation of the position and velocity limits of a run."""
    limits = scenario.robot.limits
    assert limits.position is not None
    assert limits.velocity is not None
    q, v = run.trace.q, run.trace.applied
    position = np.maximum(q - limits.position.upper, limits.position.lower - q)
    velocity = np.maximum(v - limits.velocity.upper, limits.velocity.lower - v)
    return float(position.max()), float(velocity.max())


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_only_the_ideal_plant_lets_a_command_pass_the_limits(sign: float) -> None:
    """Driven hard to one side, the saturating drive stops on the limit, the ideal one passes it."""
    scenario = _scenario(position=(0.2, 1.0), velocity=(-1.5, 2.0))

    def push(problem: DikProblem) -> Array:
        return np.full(3, sign * 5.0)

    position, velocity = _beyond(_run(push, scenario, plant=ideal), scenario)
    assert position > 0.5
    assert velocity == pytest.approx(3.0 if sign > 0 else 3.5)
    stopped = _run(push, scenario, plant=saturating)
    position, velocity = _beyond(stopped, scenario)
    assert abs(position) < 1e-12  # on the limit, not before it
    assert velocity <= 0.0
    assert np.all(stopped.trace.commanded == sign * 5.0)


def test_the_ideal_plant_applies_the_command() -> None:
    """To the bit, limits or not."""
    run = _run(lambda problem: 40 * _exact(problem), _scenario(duration=0.05))
    assert np.array_equal(run.trace.applied, run.trace.commanded)


@settings(deadline=None)
@given(
    v=arrays(float, 3, elements=st.floats(-20, 20)),
    q=arrays(float, 3, elements=st.floats(-1.5, 1.5)),
    dt=st.floats(1e-3, 0.1),
)
def test_the_saturating_plant_goes_no_further_out(v: Array, q: Array, dt: float) -> None:
    """Inside it ends inside, outside it goes no further out, and no joint waits for another."""
    limits = load_robot("planar3r").with_limits(position=1.0, velocity=2.0).limits.at(q)
    applied = saturating(v, limits, dt)
    after = q + applied * dt
    assert np.all(np.abs(applied) <= 2.0)
    assert np.all(np.abs(after) <= np.maximum(1.0, np.abs(q)) + 1e-12)
    # From inside, what is applied is the command clipped to where it may go.
    for j in np.flatnonzero(np.abs(q) <= 1.0):
        expected = np.clip(np.clip(v[j], -2, 2), (-1 - q[j]) / dt, (1 - q[j]) / dt)
        assert applied[j] == pytest.approx(expected, abs=1e-12)


def test_without_limits_the_saturating_plant_is_ideal() -> None:
    """Nothing in force clips nothing."""
    free = load_robot("planar3r").with_limits(position=None, velocity=None)
    limits: Limits = free.limits.at(free.q0)
    v = np.array([1e3, -1e3, 0.0])
    assert np.array_equal(saturating(v, limits, 0.01), v)
    assert PLANTS == {"ideal": ideal, "saturating": saturating}


# --- how laws end a trial


def _at_step(k: int, wrong: Callable[[], Any]) -> Callable[[DikProblem], Any]:
    """A law that does the task until step k, and then something wrong."""
    steps = iter(range(10**6))
    return lambda problem: wrong() if next(steps) == k else _exact(problem)


def _raise(error: BaseException) -> Any:
    raise error


@pytest.mark.parametrize(
    ("wrong", "status", "message"),
    [
        (lambda: _raise(ValueError("no\nsecond line")), "formulation-error", "ValueError: no$"),
        (lambda: _raise(KeyError("gain")), "formulation-error", "KeyError: 'gain'$"),
        (lambda: _raise(RuntimeError()), "formulation-error", "RuntimeError"),
        (lambda: np.linalg.inv(np.zeros((3, 3))), "formulation-error", "LinAlgError: Singular"),
        (lambda: _raise(MemoryError()), "out-of-memory", ""),
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
    run = _run(_at_step(k, wrong), mode=mode)
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
    run = _run(lambda problem: np.array([0, 1, -1], dtype=kind))
    assert run.status is Status.OK
    assert run.trace.q[-1] == pytest.approx([0.4, 0.8 + 0.3, 0.7 - 0.3])


def test_a_motion_without_bounds_is_ended() -> None:
    """A target 200 m away is no task error that a law can be judged by."""
    scenario = _scenario()
    far = pin.SE3(np.eye(3), np.array([200.0, 0.0, 0.0]))
    run = _run(_exact, replace(scenario, reference=target_at_rest(far, 0.3)))
    assert run.status is Status.DIVERGED
    assert run.message == "step 0: task error above 100 m, rad"
    assert run.trace.steps == 0


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
    run = _run(_at_step(7, lambda: _raise(error)))
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

    run = _run(Silent())
    assert run.status is Status.FORMULATION_ERROR
    assert "set program = 'qp' or 'lp'" in run.message


@dataclass(frozen=True)
class _Projection:
    """The velocity nearest to the exact one inside the limits, as a quadratic program."""

    program: ClassVar[Program] = "qp"

    def velocity(self, problem: DikProblem, solve: Solve) -> Array:
        """See `Formulation`."""
        box = problem.box()
        return solve(QuadraticProgram(np.eye(3), -_exact(problem), lb=box.lower, ub=box.upper))


class _Liar:
    """A back end that claims every answer, and is 0.5 rad/s beside the right one at step 5."""

    def __init__(self) -> None:
        self.calls = 0

    def __call__(self, program: QuadraticProgram) -> Answer:
        assert program.lb is not None
        assert program.ub is not None
        self.calls += 1
        x = np.clip(-program.q, program.lb, program.ub)
        z_box = -program.q - x
        return Answer(x + (0.5 if self.calls == 6 else 0.0), True, z_box=z_box)


def test_a_lying_solver_is_caught_and_its_answer_applied() -> None:
    """`not-verified` at that step alone; its residual is in the trace, in rad/s."""
    run = _run(_Projection(), solve=CheckedSolve(_Liar()))
    assert run.status is Status.OK
    assert np.flatnonzero(run.trace.status).tolist() == [5]
    assert run.trace.status[5] == STEP_CODE[Status.NOT_VERIFIED]
    assert run.trace.dual[5] == pytest.approx(0.5)
    assert np.delete(run.trace.dual, 5).max() < 1e-12


@dataclass(frozen=True)
class _Impossible:
    """x = 0 and x = 1, always."""

    program: ClassVar[Program] = "qp"

    def velocity(self, problem: DikProblem, solve: Solve) -> Array:
        """See `Formulation`."""
        A = np.array([[1.0, 0.0, 0.0], [1.0, 0.0, 0.0]])
        return solve(QuadraticProgram(np.eye(3), np.zeros(3), A=A, b=np.array([0.0, 1.0])))


@pytest.mark.parametrize("solver", ["daqp", "piqp", "proxqp"])
def test_an_infeasible_program_is_a_status_of_its_steps(solver: str) -> None:
    """Said by the solver: infeasible. Claimed solved by it: not verified. Nothing else."""
    run = _run(_Impossible(), solve=make_solve(parse_solver(solver), "qp"))
    assert run.status is Status.OK
    caught = run.trace.share(Status.INFEASIBLE) + run.trace.share(Status.NOT_VERIFIED)
    assert caught == pytest.approx(1.0)


def test_steps_that_go_nowhere_are_stuck() -> None:
    """Less than 1 % of the wanted motion; a hundredth and a bit is not."""
    for share, stuck in ((0.0099, 1.0), (0.0101, 0.0), (-0.5, 1.0)):
        run = _run(lambda problem, share=share: share * _exact(problem))
        assert run.trace.share(Status.STUCK) == stuck


# --- the fallback


def _problem(v_prev: Array | None, **limits: Any) -> DikProblem:
    robot = load_robot("planar3r").with_limits(**limits)
    return DikProblem(robot, robot.q0, v_prev, 0.01, [], robot.limits.at(robot.q0))


@settings(deadline=None)
@given(
    v_prev=arrays(float, 3, elements=st.floats(-2, 2)),
    down=arrays(float, 3, elements=st.floats(0.5, 30)),
    up=arrays(float, 3, elements=st.floats(0.5, 30)),
)
def test_the_fallback_slows_down_uniformly(v_prev: Array, down: Array, up: Array) -> None:
    """To c v_prev with the smallest c in [0, 1] that the acceleration limits allow, in the box."""
    problem = _problem(v_prev, position=None, acceleration=(-down, up))
    v = fallback(problem)
    size = float(v_prev @ v_prev)
    c = float(v @ v_prev) / size if size > 0 else 0.0
    assert v == pytest.approx(c * v_prev, abs=1e-9)
    assert -1e-12 <= c <= 1

    def allowed(factor: float) -> bool:
        change = (factor - 1) * v_prev / problem.dt
        return bool(np.all((change >= -down - 1e-6) & (change <= up + 1e-6)))

    assert allowed(c)
    assert c <= 1e-6 or not allowed(c - 1e-3)
    box = problem.box()
    assert np.all((box.lower <= v) & (v <= box.upper))


@pytest.mark.parametrize("v_prev", [None, np.array([1.0, -2.0, 0.5])])
def test_without_acceleration_limits_the_fallback_stops(v_prev: Array | None) -> None:
    """At once: nothing forbids it."""
    assert np.array_equal(fallback(_problem(v_prev)), np.zeros(3))


def test_the_fallback_stays_in_the_box() -> None:
    """Too fast towards a limit: clipped; outside it: the way back."""
    v_prev, first = np.array([2.0, 0.0, 0.0]), load_robot("planar3r").q0[0]
    near = _problem(v_prev, position=(-2.0, [first + 0.005, 2.0, 2.0]), acceleration=10.0)
    # 0.005 rad in three steps of 10 ms, the later ones 0.1 and 0.2 rad/s slower: 0.8/3 rad/s.
    assert fallback(near) == pytest.approx([0.8 / 3, 0.0, 0.0])
    outside = _problem(None, position=(-2.0, [first - 0.1, 2.0, 2.0]))
    assert fallback(outside) == pytest.approx([-0.2, 0.0, 0.0])  # a tenth of 2 rad/s


def test_the_fallback_brings_a_robot_to_rest() -> None:
    """A law that never answers: the slowest joint's limit sets the pace, the path is straight."""
    scenario = _scenario(acceleration=[1.0, 30.0, 30.0])
    run = _run(lambda problem: _raise(Infeasible("never")), replace(scenario, duration=0.6))
    speeds = run.trace.applied[:, 0]
    assert speeds == pytest.approx(np.maximum(0.5 - 0.01 * np.arange(1, 61), 0.0), abs=1e-12)
    assert run.trace.applied == pytest.approx(np.outer(speeds / 0.5, RATE), abs=1e-12)
    assert run.trace.share(Status.INFEASIBLE) == 1.0


# --- the same again, and the trace


def _same(a: Trace, b: Trace) -> None:
    for field in fields(Trace):
        x, y = np.asarray(getattr(a, field.name)), np.asarray(getattr(b, field.name))
        assert x.dtype == y.dtype, field.name
        assert np.array_equal(x, y, equal_nan=x.dtype.kind == "f"), field.name


@pytest.mark.parametrize(
    ("law", "solver"), [("pinv[after=clip]", ""), ("qp", "daqp"), ("qp", "osqp")]
)
@pytest.mark.parametrize("mode", ["time", "path"])
def test_the_same_run_gives_the_same_bits(law: str, solver: str, mode: Any) -> None:
    """With one scenario and one law used again, and with all of them made anew."""

    def once(scenario: Scenario) -> Trace:
        formulation = make_formulation(law)
        solve = make_solve(parse_solver(solver) if solver else None, "qp")
        return simulate(scenario, formulation, solve, saturating, mode).trace

    scenario = make_scenario("near-miss[miss=0.05,dt=0.01]", seed=1)
    first = once(scenario)
    _same(once(scenario), first)
    _same(once(make_scenario("near-miss[miss=0.05,dt=0.01]", seed=1)), first)


def test_a_trace_comes_back_as_it_was_saved(tmp_path: Path) -> None:
    """Every array to the bit, with its type."""
    trace = _run(_at_step(7, lambda: _raise(Infeasible("x"))), _scenario(acceleration=5.0)).trace
    path = tmp_path / "trace.npz"
    trace.save(path)
    _same(Trace.load(path), trace)
    assert isinstance(Trace.load(path).dt, float)


def test_an_empty_trace_can_be_saved(tmp_path: Path) -> None:
    """A trial that ended at step 0 has one configuration and no step."""
    trace = _run(lambda problem: None).trace
    assert trace.steps == 0
    assert np.isnan(trace.share(Status.OK))
    trace.save(tmp_path / "trace.npz")
    _same(Trace.load(tmp_path / "trace.npz"), trace)


class _Payload:
    """An object that does something when it is unpickled."""

    def __init__(self, path: Path) -> None:
        self.path = path

    def __reduce__(self) -> Any:
        return (Path.touch, (self.path,))


def test_no_pickle_is_read(tmp_path: Path) -> None:
    """A trace from outside is data: an array of objects is refused before it is made."""
    trace, proof = _run(_exact).trace, tmp_path / "proof"
    path = tmp_path / "trace.npz"
    trace.save(path)
    hidden = io.BytesIO()
    np.save(hidden, np.array([_Payload(proof)], dtype=object), allow_pickle=True)
    with zipfile.ZipFile(path) as stored:
        parts = {name: stored.read(name) for name in stored.namelist()}
    assert "q.npy" in parts
    with zipfile.ZipFile(path, "w") as forged:
        for name, data in {**parts, "q.npy": hidden.getvalue()}.items():
            forged.writestr(name, data)
    with pytest.raises(ValueError, match="allow_pickle"):
        Trace.load(path)
    assert not proof.exists()
    # The payload is a real one: numpy would run it if it were allowed to.
    hidden.seek(0)
    np.load(hidden, allow_pickle=True)
    assert proof.exists()
