"""How near a joint is to its limits, on motions made by hand."""

from __future__ import annotations

import numpy as np

from dikbench.arrays import Array
from dikbench.metrics import METRICS, motion_of
from dikbench.plugins.building import make_scenario
from dikbench.robots.loading import load_robot
from dikbench.simulation.trace import Trace
from dikbench.viewer.limit_use import Nearness, nearness

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
