"""The closed loop: how long it runs, what laws see, what plants let pass, its trace."""

from __future__ import annotations

import time
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from makers.scenarios import RATE, Recording, at_step, exact, planar_scenario, run_on_planar
from makers.traces import assert_same_trace
from makers.turns import in_turns

from dikbench.arrays import Array
from dikbench.metrics import motion_of
from dikbench.plugins.building import make_formulation, make_scenario
from dikbench.problem import DikProblem
from dikbench.problem.tasks import PostureTask
from dikbench.scenario import Scenario
from dikbench.scenario.plant import Ideal, Saturating
from dikbench.simulation.closed_loop import Run, simulate
from dikbench.simulation.status import STEP_CODE, Status
from dikbench.simulation.trace import Trace
from dikbench.solvers.catalogue.back_ends import parse_solver
from dikbench.solvers.checked_solve import make_solve
from dikbench.solvers.interfaces.warm.warm_solver import WORKSPACES

# --- how long a run is


@pytest.mark.parametrize(
    ("duration", "dt", "steps"),
    [(0.3, 0.01, 30), (0.3, 0.007, 43), (0.07, 0.05, 1), (0.01, 0.01, 1)],
)
def test_a_time_indexed_run_lasts_as_long_as_its_scenario(
    duration: float, dt: float, steps: int
) -> None:
    """duration/dt steps, rounded; one more configuration than steps; tau is the clock."""
    run = run_on_planar(exact, planar_scenario(duration=duration, dt=dt))
    assert (run.status, run.message) == (Status.OK, "")
    assert run.trace.steps == steps
    assert run.trace.q.shape == (steps + 1, 3)
    assert run.trace.tau == pytest.approx(dt * np.arange(steps + 1))
    for name in (
        "wanted",
        "commanded",
        "applied",
        "status",
        "relaxed",
        "claimed",
        "verified",
        "primal",
        "dual",
        "gap",
    ):
        assert len(getattr(run.trace, name)) == steps


def test_a_path_indexed_run_ends_with_the_path() -> None:
    """A law that does all that is wanted needs the nominal time."""
    run = run_on_planar(exact, mode="path")
    assert run.status is Status.OK
    assert run.trace.steps in {30, 31}
    assert run.trace.tau[-1] == pytest.approx(0.3)
    assert np.all(np.diff(run.trace.tau) >= 0)


@pytest.mark.parametrize("share", [0.5, 0.25])
def test_a_path_indexed_reference_waits_for_a_slow_law(share: float) -> None:
    """At a share of the speed it never gets away by more than a period, and takes as much longer.

    The twist that is wanted grows with what is left to do, so that the law is a little faster.
    """
    run = run_on_planar(lambda problem: share * exact(problem), mode="path")
    # The last twist leads to the end and not past it: who is slow takes a few more steps there.
    assert 26 / share < run.trace.steps <= 31 / share
    moved = np.diff(run.trace.tau)
    assert np.all((moved > 0) & (moved < 0.01 + 1e-12))


def test_a_path_indexed_reference_does_not_run_ahead_or_back() -> None:
    """Twice the wanted speed is full progress, a reversal none after the first period."""
    fast = run_on_planar(lambda problem: 2 * exact(problem), mode="path")
    assert np.diff(fast.trace.tau) == pytest.approx(0.01)
    back = run_on_planar(lambda problem: -0.01 * exact(problem), mode="path")
    assert back.trace.tau[0] == 0
    assert back.trace.tau[1:] == pytest.approx(0.01, abs=1e-4)


def test_a_path_indexed_run_gives_up_after_five_times_its_duration() -> None:
    """A law that stands still is not waited for for ever; the trial is ok, its steps are stuck."""
    run = run_on_planar(lambda problem: np.zeros(3), mode="path")
    assert run.status is Status.OK
    assert run.trace.steps == 150
    assert run.trace.tau[1:] == pytest.approx(0.01)
    assert run.trace.share(Status.STUCK) == 1.0


def test_a_path_indexed_run_of_a_target_at_rest_moves_on_when_there() -> None:
    """A dwell has no progress to wait for: the clock moves on."""
    scenario = planar_scenario(rate=np.zeros(3))
    run = run_on_planar(exact, scenario, mode="path")
    assert run.trace.steps in {30, 31}
    assert np.all(run.trace.status == STEP_CODE[Status.OK])


# --- what a law sees


def test_a_law_sees_the_state_that_it_made() -> None:
    """The integral of what was applied, what was applied last, and the period."""
    law = Recording(lambda problem: 3 * exact(problem))
    scenario = planar_scenario(velocity=1.0)
    run = run_on_planar(law, scenario, plant=Saturating())
    assert np.array_equal(law.seen[0].q, scenario.q0)
    before = [problem.v_prev for problem in law.seen if problem.v_prev is not None]
    assert np.array_equal(before[0], scenario.v0)
    clipped = 0
    for k in range(1, 30):
        assert np.array_equal(law.seen[k].q, run.trace.q[k])
        assert np.array_equal(before[k], run.trace.applied[k - 1])
        assert run.trace.q[k] == pytest.approx(run.trace.q[k - 1] + 0.01 * run.trace.applied[k - 1])
        assert law.seen[k].dt == 0.01
        clipped += not np.array_equal(run.trace.commanded[k], run.trace.applied[k])
    assert clipped > 10  # else the command would do as well


def test_a_law_sees_limits_and_tasks_of_its_configuration() -> None:
    """Distances to the limits at q, the tracking task first, secondary tasks after it."""
    scenario = planar_scenario()
    scenario = replace(scenario, tasks=(PostureTask(target=scenario.q0, gain=1.0),))
    law = Recording(exact)
    run_on_planar(law, scenario)
    upper = 2.8
    for problem in law.seen:
        assert problem.limits.to_upper == pytest.approx(upper - problem.q)
        assert problem.tasks[1].error == pytest.approx(scenario.q0 - problem.q)
        assert [task.priority for task in problem.tasks] == [1, 2]
        assert problem.primary is problem.tasks[0]


def test_feed_forward_and_gain_hold_the_reference() -> None:
    """The exact law stays on a reference that it started on (to second order in dt)."""
    for dt, error in ((0.01, 1e-4), (0.001, 1e-6)):
        run = run_on_planar(exact, planar_scenario(dt=dt))
        expected = np.array([0.4, 0.8, 0.7]) + run.trace.tau[:, None] * RATE
        assert np.abs(run.trace.q - expected).max() < error


def test_a_scenario_survives_its_runs() -> None:
    """It is made once and run by every law: start, velocity and robot stay as they are."""
    scenario = planar_scenario()
    before = scenario.q0.copy(), scenario.v0.copy(), scenario.robot.q0.copy()
    run_on_planar(lambda problem: 3 * exact(problem), scenario)
    run_on_planar(lambda problem: np.full(3, 1e9), scenario)
    after = scenario.q0, scenario.v0, scenario.robot.q0
    for a, b in zip(before, after, strict=True):
        assert np.array_equal(a, b)


def test_what_a_law_does_to_its_problem_reaches_neither_record_nor_plant() -> None:
    """It may put other arrays and limits into the problem: that is its own affair."""
    scenario = planar_scenario(velocity=1.0)
    free = scenario.robot.with_limits(velocity=None, position=None).limits.at(scenario.q0)

    def spoil(problem: DikProblem) -> Array:
        v = 10 * exact(problem)
        problem.limits = free
        problem.tasks[0].V, problem.tasks[0].J = np.zeros(3), np.zeros((3, 3))
        return v

    for mode in ("time", "path"):
        spoilt = run_on_planar(spoil, scenario, plant=Saturating(), mode=mode).trace
        assert_same_trace(
            spoilt,
            run_on_planar(lambda p: 10 * exact(p), scenario, plant=Saturating(), mode=mode).trace,
        )
        assert np.abs(spoilt.applied).max() == 1.0


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
    scenario = planar_scenario(position=(0.2, 1.0), velocity=(-1.5, 2.0))

    def push(problem: DikProblem) -> Array:
        return np.full(3, sign * 5.0)

    position, velocity = _beyond(run_on_planar(push, scenario, plant=Ideal()), scenario)
    assert position > 0.5
    assert velocity == pytest.approx(3.0 if sign > 0 else 3.5)
    stopped = run_on_planar(push, scenario, plant=Saturating())
    position, velocity = _beyond(stopped, scenario)
    assert abs(position) < 1e-12  # on the limit, not before it
    assert velocity <= 0.0
    assert np.all(stopped.trace.commanded == sign * 5.0)


def test_the_ideal_plant_applies_the_command() -> None:
    """To the bit, limits or not."""
    run = run_on_planar(lambda problem: 40 * exact(problem), planar_scenario(duration=0.05))
    assert np.array_equal(run.trace.applied, run.trace.commanded)


# --- the same again


ALIKE = (
    ("pinv[after=clip]", ""),
    ("qp", "daqp"),
    ("qp", "osqp"),
    # ProxQP depends on where its memory is, in the last bit.
    *(("qp", f"{name}[interface=warm]") for name in WORKSPACES if name != "proxqp"),
)


@pytest.mark.parametrize(("pair", "mode"), in_turns(ALIKE, ["time", "path"]))
def test_the_same_run_gives_the_same_bits(pair: tuple[str, str], mode: Any) -> None:
    """With one scenario and one law used again, and with all of them made anew."""
    law, solver = pair

    def once(scenario: Scenario) -> Trace:
        formulation = make_formulation(law)
        solve = make_solve(parse_solver(solver) if solver else None, "qp")
        return simulate(scenario, formulation, solve, Saturating(), mode).trace

    scenario = make_scenario("near-miss[miss=0.05,dt=0.02]", seed=1)
    first = once(scenario)
    assert_same_trace(once(scenario), first)
    assert_same_trace(once(make_scenario("near-miss[miss=0.05,dt=0.02]", seed=1)), first)


# --- what a run brings back beside its trace


def test_a_run_brings_its_jacobians_and_its_times() -> None:
    """One task Jacobian per step that was applied, at the configuration before it."""
    law = Recording(at_step(7, lambda: None))
    for run in (run_on_planar(exact), run_on_planar(law)):
        motion = motion_of(run.trace, planar_scenario())
        assert run.jacobians.shape == (run.trace.steps, 3, 3)
        assert np.array_equal(run.jacobians, motion.jacobians[:-1])
        assert run.kinematics_ns > 0
        assert run.formulation_ns > 0
    assert run.trace.steps == 7
    assert run_on_planar(lambda problem: None).jacobians.shape == (0, 3, 3)


def test_the_law_takes_its_own_time() -> None:
    """What a law sleeps is on its clock, not on that of the kinematics."""

    def slow(problem: DikProblem) -> Array:
        time.sleep(0.002)
        return exact(problem)

    run = run_on_planar(slow)
    assert run.formulation_ns > 30 * 2e6
    assert run.kinematics_ns < 30 * 2e6


def test_what_was_solved_is_in_the_trace() -> None:
    """-1 where nothing was solved, else whether it was claimed and whether it is verified."""
    assert np.all(run_on_planar(exact).trace.claimed == -1)
    assert np.all(run_on_planar(exact).trace.verified == -1)
    solve = make_solve(parse_solver("daqp"), "qp")
    for _ in range(2):  # the second run does not see the first
        trace = run_on_planar(make_formulation("qp"), solve=solve).trace
        assert trace.claimed.tolist() == trace.verified.tolist() == [1] * 30
