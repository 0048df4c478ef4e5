"""What the measures of a path say of motions whose answer is known: the exact one, and none."""

from __future__ import annotations

import math
from dataclasses import replace
from functools import cache
from types import SimpleNamespace
from typing import Any, cast

import numpy as np
import pinocchio as pin
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from dikbench.arrays import Array
from dikbench.metrics import METRICS, Motion, evaluate, motion_of
from dikbench.metrics.chatter import _reversals, _shaking, largest_acceleration
from dikbench.plugins.building import make_plant, make_scenario
from dikbench.problem import DikProblem, Solve
from dikbench.problem.problem import Formulation
from dikbench.scenario import Scenario
from dikbench.scenario.reference.embedded_path import EmbeddedPath
from dikbench.scenario.reference.path import ReferencePath
from dikbench.simulation.closed_loop import simulate
from dikbench.simulation.oracle_formulation import OracleFormulation
from dikbench.solvers.checked_solve import make_solve

FAMILIES = (
    "speed-sweep[laps=1]",
    "near-miss[miss=0.02]",
    "back-and-forth",
    "pick-and-place",
    "task-conflict",
    "joint-limit-approach",
    "humanoid[laps=1]",
)


class Idle:
    """Stands still."""

    def velocity(self, problem: DikProblem, solve: Solve) -> Array:
        """Return v = 0."""
        return np.zeros(problem.robot.nv)


@cache
def scenario_of(name: str) -> Scenario:
    """Built once."""
    return make_scenario(name)


def motion(scenario: Scenario, law: Formulation) -> Motion:
    """The motion of a time-indexed run without a solver."""
    run = simulate(scenario, law, make_solve(None, None), make_plant("ideal"))
    return motion_of(run.trace, scenario, run.jacobians)


@pytest.mark.parametrize("name", FAMILIES)
def test_the_exact_motion_is_on_its_path_all_of_it_and_in_time(name: str) -> None:
    """Within 0.01 mm, not a sample late, all done, on course; at a tolerance of 0.05 mm as well."""
    scenario = scenario_of(name)
    got = evaluate(motion(scenario, OracleFormulation.of(scenario)))
    assert got["contour_error_6d_max_m"] <= 1e-5
    assert got["tracking_error_6d_max_m"] <= 1e-4
    assert got["lag_max_s"] == got["lag_final_s"] == 0.0
    assert got["path_done_share"] == 1.0
    # Between two steps the motion is taken to be straight, the path bends.
    assert got["path_done_99_tolerance_m"] <= 5e-5
    assert got["lag_tolerance_m"] <= 5e-5
    assert got["course_rad"] <= math.radians(1)
    assert math.isnan(got["slow_down"])


@pytest.mark.parametrize("name", ["speed-sweep[laps=1]", "back-and-forth", "hexagon"])
def test_standing_still_covers_next_to_nothing_of_a_closed_path(name: str) -> None:
    """Though the path ends where the robot stands; and it is late by nearly all of it."""
    scenario = scenario_of(name)
    got = evaluate(motion(scenario, Idle()))
    assert got["path_done_share"] < 0.05
    assert got["lag_final_s"] > 0.8 * scenario.reference.duration
    assert got["path_done_99_tolerance_m"] > 5 * scenario.tolerance_m
    assert got["path_done_90_tolerance_m"] <= got["path_done_99_tolerance_m"]


@settings(max_examples=40, deadline=None)
@given(seed=st.integers(0, 2**32 - 1))
def test_the_nearest_point_of_a_path_is_the_least_over_its_pieces(seed: int) -> None:
    """With rests, ways back and laps among the pieces, against every piece in turn."""
    random = np.random.default_rng(seed)
    count, d = int(random.integers(2, 150)), int(random.integers(1, 13))
    points = np.cumsum(
        random.choice([0.0, 1e-4, 1e-2], (count, 1)) * random.normal(size=(count, d)), 0
    )
    arcs = np.append(0.0, np.cumsum(np.linalg.norm(np.diff(points, axis=0), axis=1)))
    path = EmbeddedPath(np.arange(float(count)), points, arcs, count - 1)
    asked = points[random.integers(0, count, 20)] + random.choice([0, 1e-3, 0.1]) * random.normal(
        size=(20, d)
    )
    away, lengths = asked[:, None] - points[:-1], np.sqrt(path.squares)
    directions = path.pieces / np.where(lengths > 0, lengths, 1.0)[:, None]
    along = np.minimum(np.maximum(np.einsum("ijk,jk->ij", away, directions), 0.0), lengths)
    squares = np.sum((away - along[..., None] * directions) ** 2, axis=2)
    distances, pieces, shares = path.nearest(asked)
    np.testing.assert_allclose(distances, np.sqrt(squares.min(axis=1)), atol=1e-12)
    feet = points[pieces] + shares[:, None] * path.pieces[pieces]
    np.testing.assert_allclose(np.linalg.norm(asked - feet, axis=1), distances, atol=1e-12)


@settings(max_examples=40, deadline=None)
@given(seed=st.integers(0, 2**32 - 1))
def test_the_distance_from_a_path_is_the_least_over_its_pieces(seed: int) -> None:
    """Of pieces of any length, with ways back, for points near and far, more than a block."""
    random = np.random.default_rng(seed)
    count = int(random.integers(2, 150))
    steps = random.choice([1e-4, 1e-2, 0.1], (count, 1)) * random.normal(size=(count, 3))
    path = ReferencePath(np.cumsum(steps, axis=0), int(random.integers(1, count)))
    asked = path.vertices[random.integers(0, path.once, 150)]
    asked = asked + random.choice([0, 1e-3, 0.1], (150, 1)) * random.normal(size=(150, 3))
    away, lengths = asked[:, None] - path.vertices[:-1], np.sqrt(path.squares)
    directions = path.pieces / lengths[:, None]
    along = np.minimum(np.maximum(np.einsum("ijk,jk->ij", away, directions), 0.0), lengths)
    distances = np.linalg.norm(away - along[..., None] * directions, axis=2)
    expected = distances[:, : path.once].min(axis=1)
    np.testing.assert_allclose(path.distances(asked), expected, atol=1e-12)


def test_of_a_path_that_runs_over_itself_the_first_pieces_count() -> None:
    """There and back on the same samples: whichever copy a search comes upon, it is the first."""
    there = np.column_stack([np.linspace(0, 1, 60) ** 3, np.zeros(60)])
    points = np.concatenate([there, there[-2::-1]])
    arcs = np.append(0.0, np.cumsum(np.linalg.norm(np.diff(points, axis=0), axis=1)))
    path = EmbeddedPath(np.arange(119.0), points, arcs, 118)
    asked = np.column_stack([np.linspace(0, 1, 500), np.full(500, 0.01)])
    distances, pieces, _ = path.nearest(asked)
    assert (pieces < 59).all()
    np.testing.assert_allclose(distances, 0.01, atol=1e-12)


def test_a_foot_that_slips_counts_like_the_hand() -> None:
    """All of the humanoid is carried 3 cm sideways: hand and feet are off, by the same."""
    scenario = scenario_of("humanoid[laps=1]")
    assert len(scenario.held_frames) == 2
    exact = motion(scenario, OracleFormulation.of(scenario))
    q = exact.trace.q.copy()
    q[40:, 0] += 0.03
    moved = motion_of(replace(exact.trace, q=q), scenario)
    hand = np.linalg.norm(moved.points - moved.target_points, axis=1)
    assert moved.tracking_error[50] == pytest.approx(0.03, abs=1e-6)
    assert hand[50] == pytest.approx(0.03, abs=1e-6)
    on_path = replace(moved, points=exact.points)  # the hand alone is back
    assert on_path.tracking_error[50] == pytest.approx(0.03, abs=1e-6)
    assert on_path.contour_error_6d[50] == pytest.approx(0.03, abs=1e-6)
    assert METRICS["path_done_99_tolerance_m"].of(on_path) == pytest.approx(0.03, abs=1e-6)


@pytest.mark.parametrize(("factor", "expected"), [(1.01, 1.0), (0.99, 0.0)])
@pytest.mark.parametrize("dt", [0.002, 0.01])
def test_chatter_is_back_and_forth_beyond_the_acceleration_limit(
    factor: float, expected: float, dt: float
) -> None:
    """Of a joint whose velocity alternates, whatever the control period; but for the first step."""
    n = 100
    v = np.zeros(n)
    v[::2] = factor * largest_acceleration(scenario_of("speed-sweep[laps=1]").robot)[2] * dt
    # Slower than this nothing shakes: what is left is what jumps.
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("dikbench.metrics.chatter.SHAKING_AMPLITUDE", 1.0)
        assert _chattering_steps(v, dt) == expected * (n - 1)


@settings(max_examples=60, deadline=None)
@given(seed=st.integers(0, 2**32 - 1))
def test_all_who_shake_are_found(seed: int) -> None:
    """Against every reversal of every joint: of noise, waves and rests of any size and pace."""
    random = np.random.default_rng(seed)
    scenario = scenario_of("speed-sweep[laps=1]")
    assert scenario.robot.limits.velocity is not None
    most, n = scenario.robot.limits.velocity.upper, int(random.integers(1, 120))
    waves = np.sin(np.arange(n)[:, None] * random.uniform(0, 2, 7) + random.uniform(0, 6, 7))
    v = most * random.choice([0, 1e-3, 0.006, 0.02, 0.2], (n, 7)) * waves
    v[random.random((n, 7)) < random.choice([0, 0.3])] = 0.0
    v = np.cumsum(v, axis=0) if random.random() < 0.5 else v
    velocities = np.vstack([np.zeros(7), v])
    longest = 2 / (10.0 * scenario.dt) * (1 + 1e-9)
    expected = np.zeros(n, dtype=bool)
    for joint in range(7):
        turned = _reversals(velocities[:, joint], 0.01 * most[joint])
        for start, end in zip(turned, turned[4:], strict=False):
            if end - start <= longest:
                expected[max(start - 1, 0) : end] = True
    motion = cast(
        Any,
        SimpleNamespace(
            velocities=velocities,
            jumps=np.diff(velocities, axis=0),
            scenario=scenario,
            trace=SimpleNamespace(steps=n, dt=scenario.dt),
        ),
    )
    np.testing.assert_array_equal(_shaking(motion), expected)


def _chattering_steps(velocity: Array, dt: float) -> float:
    """Count the steps that chatter of a run in which one joint moves with a velocity, (n,)."""
    n = len(velocity)
    scenario = replace(scenario_of("speed-sweep[laps=1]"), dt=dt, v0=np.zeros(7), duration=1.0)
    v = np.zeros((n, 7))
    v[:, 2] = velocity
    q = [scenario.q0]
    for each in v:
        q.append(pin.integrate(scenario.robot.model, q[-1], each * dt))
    still = motion(scenario, Idle()).trace
    nothing, none = np.zeros(n), np.zeros(n, dtype=int)
    trace = replace(
        still, q=np.array(q), tau=dt * np.arange(n + 1.0), wanted=np.zeros((n, 6)), commanded=v,
        applied=v, status=none, relaxed=none, claimed=none, verified=none, primal=nothing,
        dual=nothing, gap=nothing, distance=nothing,
    )  # fmt: skip
    return METRICS["chatter_steps"].of(motion_of(trace, scenario))


@pytest.mark.parametrize("dt", [0.002, 0.005])
@pytest.mark.parametrize(
    ("frequency", "share", "shakes"),
    [(12.5, 0.006, True), (25.0, 0.02, True), (8.0, 0.02, False), (12.5, 0.0045, False)],
)
def test_a_joint_shakes_from_10_hz_and_1_percent_on(
    frequency: float, share: float, dt: float, *, shakes: bool
) -> None:
    """A sine on top of a slow motion, far within the accelerations; noise of 0.01 % is none."""
    scenario = scenario_of("speed-sweep[laps=1]")
    assert scenario.robot.limits.velocity is not None
    limit = scenario.robot.limits.velocity.upper[2]
    time = dt * np.arange(400)
    noise = np.random.default_rng(0).uniform(-1e-4, 1e-4, len(time))
    v = 0.02 * np.sin(0.5 * np.pi * time) + share * np.sin(2 * np.pi * frequency * time) + noise
    count = _chattering_steps(limit * v, dt)
    assert (count > 0.8 * len(time)) if shakes else count == 0


def test_a_corner_is_no_shaking() -> None:
    """Up, down and up again within 0.1 s, once in a while: paths have corners."""
    scenario = scenario_of("speed-sweep[laps=1]")
    assert scenario.robot.limits.velocity is not None
    v = np.zeros(400)
    for start in (50, 150, 250, 350):
        v[start : start + 20] = 0.05 * np.abs(np.sin(np.linspace(0, 2 * np.pi, 20)))
    assert _chattering_steps(scenario.robot.limits.velocity.upper[2] * v, 0.005) == 0
