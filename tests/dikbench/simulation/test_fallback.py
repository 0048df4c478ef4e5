"""The fallback of a step without an answer: it slows the robot down, inside its limits."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays
from makers.problems import problem_at
from makers.scenarios import RATE, planar_scenario, raises, run_on_planar

from dikbench.arrays import Array
from dikbench.errors import Infeasible
from dikbench.linear_inequalities import shortest
from dikbench.problem import DikProblem
from dikbench.problem.velocity_box import velocity_box
from dikbench.robots.loading import load_robot
from dikbench.simulation.control_step import fallback
from dikbench.simulation.status import Status


def _problem(v_prev: Array | None, **limits: Any) -> DikProblem:
    robot = load_robot("planar3r").with_limits(**limits)
    return problem_at(robot, robot.q0, [], v_prev)


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


@settings(deadline=None)
@given(
    v_prev=arrays(float, 3, elements=st.floats(-2, 2)),
    G=arrays(float, (4, 3), elements=st.floats(-1, 1)),
    room=arrays(float, 4, elements=st.floats(0, 0.5)),
)
def test_the_fallback_keeps_rows_that_going_on_would_keep(
    v_prev: Array, G: Array, room: Array
) -> None:
    """Where v_prev satisfies G v <= h, so does the fallback, with the smallest c in [0, 1]."""
    problem = _problem(v_prev, position=None, velocity=None)
    problem.G, problem.h = G, G @ v_prev + room
    v = fallback(problem)
    assert np.all(G @ v <= problem.h + 1e-9)
    assert np.abs(v).max() < 1e-6 or np.any(G @ (0.99 * v) > problem.h)


@settings(deadline=None)
@given(
    v_prev=arrays(float, 3, elements=st.floats(-2, 2)),
    G=arrays(float, (6, 3), elements=st.floats(-1, 1)),
    inside=arrays(float, 3, elements=st.floats(0, 1)),
    room=arrays(float, 6, elements=st.floats(1e-3, 0.5)),
    margin=st.floats(-0.01, 0.5),
)
def test_the_fallback_keeps_rows_and_box_wherever_both_can_be_kept(
    v_prev: Array, G: Array, inside: Array, room: Array, margin: float
) -> None:
    """Near a position limit, outside it, under acceleration limits: some velocity keeps all."""
    upper = np.add(load_robot("planar3r").q0, [margin, 0.5, 2.0])
    problem = _problem(v_prev, position=(-4.0, upper), acceleration=5.0)
    box = velocity_box(problem.limits, v_prev, problem.dt)
    G = G / np.maximum(1e-3, np.linalg.norm(G, axis=1, keepdims=True))
    problem.G, problem.h = G, G @ (box.lower + inside * (box.upper - box.lower)) + room
    v = fallback(problem)
    assert np.all((box.lower <= v) & (v <= box.upper))
    assert np.all(G @ v <= problem.h + 1e-7)


def test_the_fallback_keeps_the_joints_limits_where_rows_contradict_each_other() -> None:
    """No velocity is above 1 and below -1: the rows are broken, the box is not."""
    problem = _problem(np.array([0.5, 0.0, 0.0]))
    problem.G, problem.h = np.array([[1.0, 0, 0], [-1.0, 0, 0]]), np.array([-1.0, -1.0])
    v, box = fallback(problem), problem.box()
    assert np.all((box.lower <= v) & (v <= box.upper))


@settings(deadline=None)
@given(
    G=arrays(float, (5, 3), elements=st.floats(-1, 1)),
    point=arrays(float, 3, elements=st.floats(-1, 1)),
    others=arrays(float, (20, 3), elements=st.floats(-1, 1)),
)
def test_the_shortest_point_is_inside_and_none_is_shorter(
    G: Array, point: Array, others: Array
) -> None:
    """Of those with G x <= h; by the angle that every other one makes with it."""
    h = G @ point
    x = shortest(G, h)
    assert x is not None
    assert np.all(G @ x <= h + 1e-7)
    allowed = [y for y in [point, *others] if np.all(G @ y <= h)]
    assert all(float(x @ (y - x)) >= -1e-6 for y in allowed)


def test_the_fallback_brings_a_robot_to_rest() -> None:
    """A law that never answers: the slowest joint's limit sets the pace, the path is straight."""
    scenario = planar_scenario(acceleration=[1.0, 30.0, 30.0])
    run = run_on_planar(
        lambda problem: raises(Infeasible("never")), replace(scenario, duration=0.6)
    )
    speeds = run.trace.applied[:, 0]
    assert speeds == pytest.approx(np.maximum(0.5 - 0.01 * np.arange(1, 61), 0.0), abs=1e-12)
    assert run.trace.applied == pytest.approx(np.outer(speeds / 0.5, RATE), abs=1e-12)
    assert run.trace.share(Status.INFEASIBLE) == 1.0
