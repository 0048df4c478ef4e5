"""Whatever a trace holds, every metric has a value: a number on its side of the worst, or NaN."""

from __future__ import annotations

import math
from dataclasses import fields, replace
from functools import cache
from typing import Any

import numpy as np
import pinocchio as pin
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from dikbench.metrics import METRICS, evaluate, motion_of
from dikbench.plugins.building import make_scenario
from dikbench.problem.tasks import OrientationTask, PositionTask
from dikbench.scenario import Scenario
from dikbench.scenario.reference.reference import target_at_rest
from dikbench.simulation.closed_loop import DIVERGED_SPEED_RAD_S
from dikbench.simulation.status import STEP_STATUSES
from dikbench.simulation.trace import Trace


@cache
def scenario_named(name: str) -> Scenario:
    """Paths and points, poses, positions and orientations, with all limits and with none."""
    sweep = make_scenario("speed-sweep[robot=panda,laps=2,speed=1,dt=0.02,acceleration=true]")
    robot = sweep.robot
    free = robot.with_limits(position=None, velocity=None, acceleration=None)
    target = target_at_rest(pin.SE3.Identity(), 1.0)
    turning = replace(
        sweep.reference,
        placement=lambda tau: pin.SE3(pin.utils.rotate("x", tau), np.ones(3)),
        velocity=lambda tau: np.array([0, 0, 0, 1.0, 0, 0]),
    )
    return {
        "laps": lambda: sweep,
        "no limits": lambda: replace(sweep, robot=free),
        "position": lambda: replace(sweep, tracking=PositionTask(), tasks=()),
        "orientation": lambda: replace(sweep, tracking=OrientationTask(), tasks=()),
        "at rest": lambda: replace(sweep, reference=target),
        "in place": lambda: replace(sweep, reference=turning),
        "continuous joints": lambda: make_scenario("speed-sweep[robot=kinova,laps=1]"),
        "second task": lambda: make_scenario("task-conflict[robot=planar4r]"),
        "drift": lambda: make_scenario("log-derivative-drift"),
    }[name]()


NAMES = (
    "laps", "no limits", "position", "orientation", "at rest", "in place", "continuous joints",
    "second task", "drift",
)  # fmt: skip


def trace_of(scenario: Scenario, steps: int, speed: float, seed: int, *, waits: bool) -> Trace:
    """A random motion from the start of a scenario, at most `speed` [rad/s] fast."""
    random = np.random.default_rng(seed)
    robot, dt, m = scenario.robot, scenario.dt, len(scenario.rows)
    v = speed * random.uniform(-1, 1, (steps, robot.nv))
    v[random.random(steps) < 0.2] = 0.0
    q = [scenario.q0]
    for velocity in v:
        q.append(pin.integrate(robot.model, q[-1], velocity * dt))
    pace = random.choice([0.0, 0.5, 1.0], steps) if waits else np.ones(steps)
    wanted = random.normal(size=(steps, m))
    wanted[random.random(steps) < 0.2] = 0.0
    claimed = random.integers(-1, 2, steps)
    residuals = random.choice([0.0, 1e-6, 1e3, np.nan, np.inf], (4, steps))
    return Trace(
        dt=dt,
        q=np.array(q),
        tau=dt * np.concatenate([[0.0], np.cumsum(pace)]),
        wanted=wanted,
        commanded=v,
        applied=v,
        status=random.integers(0, len(STEP_STATUSES), steps),
        relaxed=random.integers(0, robot.nv + 1, steps),
        claimed=claimed,
        verified=np.where(claimed < 0, -1, random.integers(0, 2, steps)),
        primal=residuals[0],
        dual=residuals[1],
        gap=residuals[2],
        distance=residuals[3],
    )


def check(found: dict[str, float]) -> None:
    """Every metric is there, and no better than can be nor worse than the worst."""
    assert list(found) == list(METRICS)
    for name, value in found.items():
        metric = METRICS[name]
        assert type(value) is float, name
        if not math.isnan(value):
            sign = 1 if metric.best == "low" else -1
            assert sign * value <= sign * metric.worst, name
            assert "share" not in name or 0 <= value <= 1, name


@settings(max_examples=120, deadline=None)
@given(
    name=st.sampled_from(NAMES),
    steps=st.sampled_from([0, 1, 2, 3, 4, 7, 30, 90]),
    speed=st.sampled_from([0.0, 1e-12, 1e-3, 1.0, 30.0, DIVERGED_SPEED_RAD_S]),
    seed=st.integers(0, 2**32 - 1),
    waits=st.booleans(),
)
def test_every_trace_has_every_metric(
    name: str, steps: int, speed: float, seed: int, waits: bool
) -> None:
    """No step and few, at rest and diverging, all statuses, waiting targets: never a warning."""
    scenario = scenario_named(name)
    trace = trace_of(scenario, steps, speed, seed, waits=waits)
    check(evaluate(motion_of(trace, scenario)))


@pytest.mark.parametrize("name", NAMES)
@pytest.mark.parametrize("part", ["q", "wanted", "applied", "tau"])
@pytest.mark.parametrize("value", [np.nan, np.inf])
def test_a_motion_that_is_not_finite_has_the_worst_of_everything(
    name: str, part: str, value: float
) -> None:
    """A single number of it is enough; what a solver leaves unknown is not the motion's."""
    scenario = scenario_named(name)
    trace = trace_of(scenario, 20, 1.0, 0, waits=False)
    getattr(trace, part)[13, ...] = value
    if part == "tau":  # recomputing asks the reference where it is then
        motion = replace(
            motion_of(trace_of(scenario, 20, 1.0, 0, waits=False), scenario), trace=trace
        )
    else:
        motion = motion_of(trace, scenario)
    assert evaluate(motion) == {name: metric.worst for name, metric in METRICS.items()}


@pytest.mark.parametrize("code", range(len(STEP_STATUSES)))
def test_a_run_all_of_whose_steps_ended_alike_has_shares_of_none_and_all(code: int) -> None:
    """All failed, in every way that there is."""
    scenario = scenario_named("laps")
    whole = trace_of(scenario, 10, 1.0, 0, waits=False)
    changed: dict[str, Any] = {"status": np.full(10, code), "claimed": np.zeros(10, dtype=int)}
    got = evaluate(motion_of(replace(whole, **changed), scenario))
    answered = STEP_STATUSES[code].value in {"ok", "stuck"}
    assert got["feasible_share"] == (1.0 if answered else 0.0)
    fell_back = STEP_STATUSES[code].value in {"infeasible", "solver-failed"}
    assert got["fallback_steps"] == (10.0 if fell_back else 0.0)
    assert got["claimed_share"] == 0.0


def test_a_robot_at_rest_is_smooth_and_late() -> None:
    """Nothing moves while the target does: no jumps, no spectrum, no jerk to scale."""
    scenario = scenario_named("laps")
    still = replace(scenario, v0=np.zeros(7))
    trace = trace_of(still, 90, 0.0, 0, waits=False)
    got = evaluate(motion_of(trace, still))
    assert got["acceleration_variation_rad_s2"] == got["reversals_per_s"] == 0.0
    assert got["energy_above_10_hz_share"] == 0.0
    assert math.isnan(got["jerk_rms_scaled"])
    assert math.isnan(got["sparc"])
    # Of the path it has what is within the tolerance of its start.
    assert got["lag_final_s"] == pytest.approx(90 * still.dt, abs=still.dt)
    assert got["contour_error_max_m"] < 1e-9


def test_every_array_of_a_trace_is_looked_at_by_some_metric() -> None:
    """But for the command: what was applied is what counts."""
    scenario = scenario_named("laps")
    trace = trace_of(scenario, 30, 1.0, 5, waits=False)
    known = {name: np.arange(30) / 30 for name in ("primal", "dual", "gap", "distance")}
    trace = replace(trace, **known)  # type: ignore[arg-type]
    before = evaluate(motion_of(trace, scenario))
    for name in (field.name for field in fields(trace) if field.name not in {"dt", "mode"}):
        changed: dict[str, Any] = {name: getattr(trace, name)[::-1] + 2}
        got = evaluate(motion_of(replace(trace, **changed), scenario))
        same = np.array_equal([*got.values()], [*before.values()], equal_nan=True)
        assert same == (name == "commanded"), name
