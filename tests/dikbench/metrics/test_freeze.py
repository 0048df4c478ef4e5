"""Freezes: a robot that stands still while its target moves on, once for as long as it lasts."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from makers.scenarios import exact, planar_scenario, run_on_planar

from dikbench.metrics import METRICS, motion_of
from dikbench.scenario.reference.reference import target_at_rest

SCENARIO = planar_scenario(duration=0.3)
"""30 steps of 10 ms, in each of which the target moves 1 to 4 mm, in position and orientation."""

TRACE = run_on_planar(exact, SCENARIO).trace


def _events(steps: list[float], resting: bool = False) -> float:
    """Count the freezes of a robot whose first joint moves by so much in each step [rad]."""
    n = len(steps)
    applied = np.zeros((n, 3))
    applied[:, 0] = np.array(steps) / SCENARIO.dt
    q = np.vstack([TRACE.q[:1], TRACE.q[0] + np.cumsum(applied * SCENARIO.dt, axis=0)])
    scenario = SCENARIO
    if resting:
        scenario = replace(scenario, reference=target_at_rest(scenario.reference.placement(0), 0.3))
    names = ("wanted", "commanded", "status", "relaxed", "claimed", "verified", "primal", "dual",
             "gap", "distance")  # fmt: skip
    cut = {name: getattr(TRACE, name)[:n] for name in names}
    trace = replace(TRACE, applied=applied, q=q, tau=TRACE.tau[: n + 1], **cut)
    return METRICS["freeze_events"].of(motion_of(trace, scenario))


def test_the_target_moves_on_as_the_tests_below_take_it() -> None:
    """5 mm take more than one step and fewer than eight."""
    ways = np.linalg.norm(np.diff(motion_of(TRACE, SCENARIO).target_points, axis=0), axis=1)
    assert 0.7e-3 < ways.min()
    assert ways.max() < 4.9e-3


@pytest.mark.parametrize(
    ("steps", "events"),
    [
        ([0.0] * 30, 1),  # all the way
        ([0.01] * 30, 0),
        ([0.01] * 10 + [0.0] * 10 + [0.01] * 10, 1),
        ([0.0] * 10 + [0.01] + [0.0] * 10, 2),
        ([0.0] * 10 + [-2e-6] + [0.0] * 10, 2),  # a small movement ends it
        ([0.0] * 10 + [0.5e-6] + [0.0] * 10, 1),  # less than that is none
        ([0.01, 0.0] * 15, 0),  # the target moves less than 5 mm in each stop
        ([0.01] * 20 + [0.0] * 10, 1),  # to the end
        ([1.9e-7] * 30, 5),  # creeping: the steps add up to a movement every sixth time
        ([0.9e-6] * 30, 0),
        ([0.9e-6, -0.9e-6] * 15, 1),  # trembling about a place
    ],
)
def test_a_freeze_is_counted_once(steps: list[float], events: int) -> None:
    """However long it lasts."""
    assert _events(steps) == events


def test_a_robot_whose_target_rests_does_not_freeze() -> None:
    """It is to stand still."""
    assert _events([0.0] * 30, resting=True) == 0
