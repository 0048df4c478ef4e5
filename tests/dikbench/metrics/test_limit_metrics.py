"""Metrics of the limits of a motion made by hand: in force or not, passed or not."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from makers.tip_motions import tip_scenario, trace_of

from dikbench.metrics import evaluate, motion_of
from dikbench.simulation.status import Status


def test_limits_that_are_not_in_force_are_not_violated() -> None:
    """Zero, and a ratio that is not defined; the shares of violating steps are zero."""
    scenario = tip_scenario()
    bare = scenario.robot.with_limits(position=None, velocity=None, acceleration=None)
    trace = trace_of([1.0, -2.0], [[0.4, 0.5, 1.0]] * 2, [Status.OK] * 2)
    got = evaluate(motion_of(trace, replace(scenario, robot=bare)))
    assert got["position_violation_max_rad"] == 0.0
    assert got["velocity_violation_max_rad_s"] == 0.0
    assert got["acceleration_violation_max_rad_s2"] == 0.0
    assert got["violating_share"] == 0.0
    assert math.isnan(got["velocity_peak_ratio"])


def test_infinite_limits_are_not_violated() -> None:
    """Nor do they turn a ratio into NaN."""
    scenario = tip_scenario()
    far = scenario.robot.with_limits(position=np.inf, velocity=[np.inf, 1, 1], acceleration=np.inf)
    trace = trace_of([1.0, -2.0], [[0.4, 0.5, 1.0]] * 2, [Status.OK] * 2)
    got = evaluate(motion_of(trace, replace(scenario, robot=far)))
    assert got["violating_share"] == 0.0
    assert got["velocity_peak_ratio"] == 0.0
    assert got["acceleration_violation_max_rad_s2"] == 0.0


def test_a_one_sided_velocity_limit_is_a_ratio_on_its_side() -> None:
    """A joint that may only move forward, and does, at half its limit."""
    scenario = tip_scenario()
    forward = scenario.robot.with_limits(velocity=([0, -1, -1], 2.0))
    trace = trace_of([1.0], [[0.4, 0.5, 1.0]], [Status.OK])
    got = evaluate(motion_of(trace, replace(scenario, robot=forward)))
    assert got["velocity_peak_ratio"] == pytest.approx(0.5)
    assert got["velocity_violation_max_rad_s"] == 0.0


def test_what_a_solver_leaves_is_not_a_violation() -> None:
    """A limit passed by less than 1e-4 does not make a step violate it; by more it does."""
    scenario = tip_scenario()
    for excess, share in ((1e-12, 0.0), (0.9e-4, 0.0), (1.1e-4, 1.0)):
        limit = scenario.robot.with_limits(
            position=([-5, -5, -5], [0.1 - excess, 5, 5]),
            velocity=1.0 - excess,
            acceleration=(0.5 - excess) / 0.1,  # from 0.5 to 1 rad/s in a step of 0.1 s
        )
        trace = trace_of([1.0], [[0.4, 0.5, 1.0]], [Status.OK])
        got = evaluate(motion_of(trace, replace(scenario, robot=limit)))
        assert got["violating_share"] == share
        for kind in ("position", "velocity", "acceleration"):
            assert got[f"{kind}_violation_share"] == share


def test_a_start_outside_a_limit_is_not_a_step_that_violates_it() -> None:
    """A step answers for where it ends."""
    scenario = tip_scenario()
    limit = scenario.robot.with_limits(position=([0.05, -2, -2], 2.0), velocity=2.0)
    trace = trace_of([1.0], [[0.4, 0.5, 1.0]], [Status.OK])
    got = evaluate(motion_of(trace, replace(scenario, robot=limit)))
    assert got["violating_share"] == got["position_violation_share"] == 0.0
    assert got["position_violation_integral_rad_s"] == 0.0
    assert got["position_violation_max_rad"] == pytest.approx(0.05)
