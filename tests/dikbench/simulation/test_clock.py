"""Clocks alone: the nominal time in closed form, and when a trial is over."""

from __future__ import annotations

import itertools

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from makers.scenarios import planar_scenario

from dikbench.arrays import Array
from dikbench.simulation.clock import CLOCKS, Clock, PathClock, TimeClock

V = np.array([0.3, -0.2, 0.5])
J = np.array([[1.0, 0.5, 0.0], [0.0, 2.0, 0.0], [0.0, 0.3, 1.0]])


def _advance(clock: Clock, share: float) -> None:
    """One step at which a share of the desired twist V = J v is made."""
    clock.advance(V, J, share * np.linalg.solve(J, V))


def test_there_is_a_clock_for_each_reference_mode() -> None:
    """Both begin at 0 and are not over."""
    assert CLOCKS == {"time": TimeClock, "path": PathClock}
    for made in CLOCKS.values():
        clock = made(planar_scenario())
        assert clock.tau == 0.0
        assert len([*itertools.islice(clock, 2)]) == 2


@pytest.mark.parametrize("share", [1.0, 0.0, -3.0, 7.0])
def test_the_time_clock_does_not_look_at_the_robot(share: float) -> None:
    """After k steps tau is k dt to the bit, with the reference there; over at the duration."""
    scenario = planar_scenario(dt=0.007)
    clock, found = TimeClock(scenario), []
    for placement, twist in clock:
        expected, expected_twist = scenario.target(clock.tau)
        assert np.array_equal(placement.homogeneous, expected.homogeneous)
        assert np.array_equal(twist.vector, expected_twist.vector)
        found.append(clock.tau)
        _advance(clock, share)
    assert np.array_equal([*found, clock.tau], 0.007 * np.arange(44.0))
    assert clock.most_steps == len(found) == 43


@settings(deadline=None)
@given(shares=st.lists(st.floats(-2, 2), max_size=40))
def test_the_path_clock_adds_up_the_progress(shares: list[float]) -> None:
    """It is dt sum min(max(alpha_k, 0), 1), at most the duration; the reference is there."""
    scenario = planar_scenario()
    clock = PathClock(scenario)
    for share in shares:
        _advance(clock, share)
    expected = min(0.01 * np.clip(shares, 0, 1).sum(), 0.3)
    assert clock.tau == pytest.approx(expected, abs=1e-12)
    left = [*itertools.islice(clock, 1)]
    assert (not left) == (clock.tau >= 0.3 * (1 - 1e-9))
    if not left:
        return
    (placement, twist), there = left[0], scenario.reference.placement(clock.tau)
    assert np.array_equal(placement.homogeneous, there.homogeneous)
    assert np.array_equal(twist.vector, scenario.reference.velocity(clock.tau))


def test_progress_is_along_the_desired_twist() -> None:
    """What goes across it is no progress, in the metric with L = 0.2 m on the angular row."""
    across = np.linalg.solve(J, [0.2, 0.3, 0.0])  # J v across V
    half_linear = np.linalg.solve(J, V * [1.0, 1.0, 0.0])
    for v, alpha in ((across, 0.0), (half_linear, 0.13 / (0.13 + 0.2**2 * 0.25))):
        clock = PathClock(planar_scenario())
        clock.advance(V, J, v)
        assert clock.tau == pytest.approx(0.01 * alpha, abs=1e-15)


def test_a_dwell_passes_in_full() -> None:
    """Where no motion is desired there is no progress to wait for."""
    clock = PathClock(planar_scenario())
    nothing: Array = np.zeros(3)
    clock.advance(nothing, J, nothing)
    assert clock.tau == 0.01


def test_the_path_clock_gives_up_after_five_durations() -> None:
    """A robot that stands still, or moves back: 150 steps instead of 30, all of them at tau = 0."""
    for share in (0.0, -1.0):
        clock, steps = PathClock(planar_scenario()), 0
        for _ in clock:
            assert clock.tau == 0.0
            _advance(clock, share)
            steps += 1
        assert steps == clock.most_steps == 150
