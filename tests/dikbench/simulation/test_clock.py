"""Clocks alone: the nominal time in closed form, and when a trial is over."""

from __future__ import annotations

import itertools

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from makers.scenarios import RATE, planar_scenario

from dikbench.simulation.clock import CLOCKS, PathClock, TimeClock

Q0 = np.array([0.4, 0.8, 0.7])
"""Where the joints of `planar_scenario` begin."""


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
        clock.advance(Q0 + share * clock.tau * RATE)
    assert np.array_equal([*found, clock.tau], 0.007 * np.arange(44.0))
    assert clock.most_steps == len(found) == 43


@settings(deadline=None)
@given(shares=st.lists(st.floats(-2, 2), max_size=40))
def test_the_path_clock_is_at_most_a_period_ahead_of_the_nearest_point(shares: list[float]) -> None:
    """Of a robot that goes along the path by shares of a period, back and forth, from its start.

    min(tau + dt, max(tau, tau_near + dt)), with the robot's own place for tau_near as long as that
    is between tau - 0.1 s and tau + 2 dt, and its bound otherwise; the reference is there.
    """
    scenario = planar_scenario()
    clock, place, expected = PathClock(scenario), 0.0, 0.0
    for share in shares:
        place = min(max(place + 0.01 * share, 0.0), 0.3)
        clock.advance(Q0 + place * RATE)
        near = min(max(place, expected - 0.1), expected + 0.02)
        expected = min(expected + 0.01, max(expected, near + 0.01), 0.3)
        assert clock.tau == pytest.approx(expected, abs=1e-4)
        expected = clock.tau
    left = [*itertools.islice(clock, 1)]
    assert (not left) == (clock.tau >= 0.3 * (1 - 1e-9))
    if not left:
        return
    (placement, twist), there = left[0], scenario.reference.placement(clock.tau)
    assert np.array_equal(placement.homogeneous, there.homogeneous)
    assert np.array_equal(twist.vector, scenario.reference.velocity(clock.tau))


def test_the_path_clock_gives_up_after_five_durations() -> None:
    """A robot that stands still, or moves back: 150 steps instead of 30."""
    for share in (0.0, -1.0):
        clock, steps = PathClock(planar_scenario()), 0
        for _ in clock:
            assert clock.tau == (pytest.approx(0.01) if steps else 0.0)
            clock.advance(Q0 + share * 0.01 * steps * RATE)
            steps += 1
        assert steps == clock.most_steps == 150
