"""How near a joint is to its limits, on motions made by hand."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from dikbench.arrays import Array
from dikbench.metrics import METRICS, motion_of
from dikbench.plugins.building import make_scenario
from dikbench.problem.constraints import CollisionConstraint
from dikbench.robots.loading import load_robot
from dikbench.scenario.scenario import Scenario
from dikbench.simulation.trace import Trace
from dikbench.viewer.limit_use import Nearness, joint_nearness, limit_states, nearness

INSIDE, NEAR, PAST = Nearness


def trace(q: Array, v: Array) -> Trace:
    """A trace of configurations (n + 1, nq) and velocities (n, nv)."""
    n = len(v)
    none, codes = np.zeros(n), np.zeros(n, dtype=int)
    return Trace(
        0.01, q, np.zeros(n + 1), np.zeros((n, 6)), v, v, codes, codes, codes, codes, *4 * (none,)
    )


def test_positions_and_speeds_by_hand() -> None:
    """A planar arm with |q| <= 2.8 and |v| <= 2: each joint at a share of its own limit."""
    robot = load_robot("planar3r")
    q = np.array([[0.0, 2.5, -2.55], [2.8, -2.80005, 2.801], [0.0, 0.0, -2.81]])
    v = np.array([[1.7, 0.0, 0.0], [0.0, 1.85, -2.1]])
    expected = [[INSIDE, INSIDE, NEAR], [NEAR, NEAR, PAST], [INSIDE, INSIDE, PAST]]
    assert nearness(trace(q, v), robot.limits).tolist() == expected
    free = robot.with_limits(position=None, velocity=None).limits
    assert not nearness(trace(q, v), free).any()


def test_limits_on_one_side_and_none() -> None:
    """A range without an end has no middle: only passing its one end counts."""
    robot = load_robot("planar3r").with_limits(
        position=(np.array([-np.inf, -1.0, -1.0]), np.array([np.inf, np.inf, 1.0])), velocity=None
    )
    q = np.array([[100.0, -0.99, 0.0], [-100.0, -1.01, 0.99]])
    found = nearness(trace(q, np.zeros((1, 3))), robot.limits)
    assert found.tolist() == [[INSIDE, INSIDE, INSIDE], [INSIDE, PAST, NEAR]]


def test_past_agrees_with_the_metric() -> None:
    """The share of steps that are past a limit is the metric's `violating_share`."""
    scenario = make_scenario("reach[robot=planar3r,duration=0.2]")
    rng = np.random.default_rng(0)
    limits = scenario.robot.limits
    assert limits.position is not None
    assert limits.velocity is not None
    v = rng.uniform(-1.05, 1.05, (20, 3)) * limits.velocity.upper
    q = rng.uniform(-1.02, 1.02, (21, 3)) * limits.position.upper
    motion = trace(q, v)
    found = nearness(motion, limits)
    fast = nearness(trace(np.zeros((21, 3)), v), limits)
    ends = nearness(trace(q, np.zeros((20, 3))), limits)[1:]
    violating = ((fast[:-1] == PAST) | (ends == PAST)).any(axis=1)
    share = METRICS["violating_share"].of(motion_of(motion, scenario))
    assert 0 < share < 1
    assert violating.mean() == share
    assert (found == PAST).any()


def moved(scenario: Scenario, q: Array, v: Array | None = None) -> Trace:
    """A trace of configurations (n + 1, nq), at rest unless velocities (n, nv) are given."""
    return replace(trace(q, np.zeros((len(q) - 1, scenario.robot.nv)) if v is None else v), dt=0.01)


def test_distances_colour_both_links_of_a_pair() -> None:
    """What is nearer than the margin is past, whenever the metrics say that anything is."""
    scenario = make_scenario("obstacle[robot=panda]")
    (constraint,) = scenario.constraints
    assert isinstance(constraint, CollisionConstraint)
    assert scenario.oracle is not None
    q = scenario.oracle[::10]
    motion = moved(scenario, q)
    smallest = motion_of(motion, scenario).distances
    past = smallest < constraint.margin - 1e-4
    states = limit_states(motion, scenario)
    assert set(states) == {"position", "speed", "distance"}
    assert past.any()
    assert not past.all()
    np.testing.assert_array_equal((states["distance"] == PAST).any(axis=1), past)
    assert not (states["distance"] == PAST)[past].all(axis=1).any()  # not the whole robot


def test_torques_colour_their_joint() -> None:
    """A joint that is accelerated too much is past its torque limit, as the metrics have it."""
    scenario = make_scenario("torque-limited[robot=ur5]")
    q = np.repeat(scenario.q0[None], 4, axis=0)
    v = np.zeros((3, 6))
    v[1, 5] = 10.0
    motion = moved(scenario, q, v)
    states = limit_states(motion, scenario)["torque"]
    usage = motion_of(motion, scenario).torque_usage
    np.testing.assert_array_equal((states[:-1] == PAST).any(axis=1), usage > 1)
    assert states[1, 5] == PAST
    assert states[0].max() < PAST
    shown = limit_states(motion, scenario, np.array([0, 3]))["torque"]
    np.testing.assert_array_equal(shown, [states[0], states[1:].max(axis=0)])


@pytest.mark.parametrize("instants", [[0], [0, 5, 19, 20], [3, 4]])
def test_what_happens_between_instants_is_kept(instants: list[int]) -> None:
    """The state at an instant is the worst since the one before."""
    scenario = make_scenario("reach[robot=planar3r,duration=0.2]")
    rng = np.random.default_rng(1)
    motion = trace(rng.uniform(-3, 3, (21, 3)), rng.uniform(-2.2, 2.2, (20, 3)))
    every = joint_nearness(motion, scenario)
    np.testing.assert_array_equal(every, nearness(motion, scenario.robot.limits))
    found = joint_nearness(motion, scenario, np.array(instants))
    starts = [0, *(k + 1 for k in instants[:-1])]
    expected = [every[a : b + 1].max(axis=0) for a, b in zip(starts, instants, strict=True)]
    np.testing.assert_array_equal(found, expected)
