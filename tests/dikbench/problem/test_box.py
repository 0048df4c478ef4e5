"""The velocity box: its bounds, their order, and the way back from outside a limit."""

from __future__ import annotations

from typing import get_args

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from makers.problems import interval_of, limits_at_distances, problem_at

from dikbench.arrays import Array
from dikbench.errors import DikbenchError
from dikbench.problem.velocity_box import Braking, velocity_box
from dikbench.robots.braking import viable_brake
from dikbench.robots.limits import JointLimits
from dikbench.robots.loading import load_robot

BRAKINGS = get_args(Braking)

periods = st.floats(5e-4, 0.05)
accelerations = st.floats(0.5, 50.0)
speeds = st.floats(0.1, 10.0)
distances = st.floats(1e-6, 3.0)


@pytest.mark.parametrize("braking", BRAKINGS)
def test_a_joint_that_cannot_accelerate_stays_at_rest(braking: Braking) -> None:
    """An acceleration limit of zero is a bound like any other: no NaN, and the velocity is kept."""
    limits = limits_at_distances([0.1, 3.0], [3.0, 100.0], velocity=2.0, acceleration=0.0)
    box = velocity_box(limits, np.zeros(2), 0.01, braking)
    assert np.array_equal(box.lower, [0.0, 0.0])
    assert np.array_equal(box.upper, [0.0, 0.0])


@settings(deadline=None)
@given(
    below=distances,
    above=distances,
    vmax=speeds,
    dt=periods,
    v_prev=st.floats(-10, 10),
    braking=st.sampled_from(["viable", "sqrt"]),
)
def test_without_acceleration_limits_there_is_no_brake(
    below: float, above: float, vmax: float, dt: float, v_prev: float, braking: Braking
) -> None:
    """`viable` and `sqrt` are `one-step` then: hi = min(vmax, d/dt)."""
    limits = limits_at_distances(below, above, velocity=vmax)
    box = velocity_box(limits, np.array([v_prev]), dt, braking)
    plain = velocity_box(limits, np.array([v_prev]), dt, "one-step")
    assert (box.lower, box.upper) == (plain.lower, plain.upper)
    assert box.upper == pytest.approx(min(vmax, above / dt))
    assert box.lower == pytest.approx(-min(vmax, below / dt))


def test_without_a_previous_velocity_only_the_brake_remains() -> None:
    """v_prev = None drops the bound on acceleration, not the one on braking."""
    box = velocity_box(limits_at_distances(1.0, 0.01, velocity=2.0, acceleration=5.0), None, 0.01)
    assert box.upper == viable_brake(np.array([0.01]), np.array([5.0]), 0.01)
    assert box.lower == -2.0
    assert box.relaxed == 0


def test_each_bound_alone_is_the_bound() -> None:
    """Hi and lo follow each side of the velocity, acceleration and position limits."""
    dt, v = 0.01, np.array([0.5])
    far = limits_at_distances(9.0, 9.0, velocity=(-1.0, 2.0), acceleration=(-np.inf, np.inf))
    assert velocity_box(far, v, dt).lower == -1.0
    assert velocity_box(far, v, dt).upper == 2.0
    slow = limits_at_distances(9.0, 9.0, velocity=9.0, acceleration=(-4.0, 7.0))
    assert velocity_box(slow, v, dt).lower == pytest.approx(0.5 - 0.04)
    assert velocity_box(slow, v, dt).upper == pytest.approx(0.5 + 0.07)
    near = limits_at_distances(0.003, 0.002, velocity=9.0)
    assert velocity_box(near, v, dt).lower == pytest.approx(-0.3)
    assert velocity_box(near, v, dt).upper == pytest.approx(0.2)


def test_the_brake_uses_the_acceleration_that_slows_down() -> None:
    """Towards the upper limit the lower acceleration bound brakes, and the other way round."""
    limits = limits_at_distances(0.05, 0.05, velocity=9.0, acceleration=(-2.0, 8.0))
    box = velocity_box(limits, None, 1e-3)
    # Continuous braking sqrt(2 a d), met to first order in dt.
    assert box.upper == pytest.approx(np.sqrt(2 * 2.0 * 0.05), rel=0.02)
    assert box.lower == pytest.approx(-np.sqrt(2 * 8.0 * 0.05), rel=0.02)


@pytest.mark.parametrize("gain", [0.05, 0.5, 0.95, 1.0])
def test_gain_scales_the_position_bound(gain: float) -> None:
    """The bounds are hi = gain d/dt and lo = -gain d/dt, whatever the acceleration limits are."""
    limits = limits_at_distances(0.003, 0.002, acceleration=1e9)
    box = velocity_box(limits, np.zeros(1), 0.01, "gain", gain)
    assert box.upper == pytest.approx(gain * 0.2)
    assert box.lower == pytest.approx(-gain * 0.3)


@pytest.mark.parametrize("braking", sorted(set(BRAKINGS) - {"gain"}))
def test_the_position_gain_belongs_to_gain_braking(braking: Braking) -> None:
    """The other ways to brake do not read it."""
    limits = limits_at_distances(0.003, 0.002, velocity=1.0, acceleration=10.0)
    a, b = (velocity_box(limits, np.zeros(1), 0.01, braking, gain) for gain in (0.1, 0.9))
    assert (a.lower, a.upper) == (b.lower, b.upper)


@settings(deadline=None)
@given(
    near=st.floats(-0.5, 3.0),
    farther=st.floats(0.0, 3.0),
    acceleration=st.one_of(st.none(), accelerations),
    dt=periods,
    braking=st.sampled_from(BRAKINGS),
)
def test_more_room_never_means_less_speed(
    near: float, farther: float, acceleration: float | None, dt: float, braking: Braking
) -> None:
    """Hi grows with the distance to the upper limit, and -lo with that to the lower one."""
    distance = np.array([near, near + farther])
    limits = limits_at_distances(np.full(2, 9.0), distance, velocity=5.0, acceleration=acceleration)
    upper = velocity_box(limits, None, dt, braking).upper
    assert upper[0] <= upper[1] + 1e-12
    mirrored = limits_at_distances(
        distance, np.full(2, 9.0), velocity=5.0, acceleration=acceleration
    )
    assert np.array_equal(velocity_box(mirrored, None, dt, braking).lower, -upper)


def test_position_wins_over_acceleration_and_is_counted() -> None:
    """A joint too fast to stop gets the position bound alone; the one beside it loses nothing."""
    limits = limits_at_distances([9.0, 9.0], [0.001, 9.0], velocity=3.0, acceleration=10.0)
    box = velocity_box(limits, np.array([2.0, 2.0]), 0.01)
    assert box.lower == pytest.approx([0.1, 1.9])
    assert box.upper == pytest.approx([0.1, 2.1])
    assert box.relaxed == 1


def test_velocity_wins_over_acceleration_and_is_counted() -> None:
    """A joint that is faster than its limit is brought down to it at once."""
    limits = limits_at_distances([9.0, 9.0, 9.0], [9.0, 9.0, 9.0], velocity=2.0, acceleration=10.0)
    box = velocity_box(limits, np.array([3.0, -3.0, 2.05]), 0.01)
    assert box.lower == pytest.approx([2.0, -2.0, 1.95])
    assert box.upper == pytest.approx([2.0, -2.0, 2.0])
    assert box.relaxed == 2


def test_position_wins_over_velocity_and_acceleration_together() -> None:
    """Near the lower limit, too fast for every bound: only the position bound is left."""
    limits = limits_at_distances([0.001], [9.0], velocity=2.0, acceleration=10.0)
    box = velocity_box(limits, np.array([-5.0]), 0.01)
    assert box.lower == pytest.approx([-0.1])
    assert box.upper == pytest.approx([-0.1])
    assert box.relaxed == 1


def test_a_problem_records_what_its_box_gave_up() -> None:
    """`problem.box` leaves the number of relaxed joints in `problem.relaxed`."""
    robot = load_robot("planar3r").with_limits(velocity=2.0, acceleration=10.0)
    v_prev = np.array([3.0, 0.0, -3.0])
    problem = problem_at(robot, robot.q0, [], v_prev)
    assert problem.relaxed == 0
    assert problem.box().relaxed == 2
    assert problem.relaxed == 2


@settings(deadline=None)
@given(
    outside=st.floats(1e-9, 2.0),
    v_down=speeds,
    v_up=speeds,
    dt=periods,
    acceleration=st.one_of(st.none(), accelerations),
    braking=st.sampled_from(BRAKINGS),
)
def test_outside_a_limit_the_box_asks_for_the_way_back(
    outside: float,
    v_down: float,
    v_up: float,
    dt: float,
    acceleration: float | None,
    braking: Braking,
) -> None:
    """Hi = max(d/dt, -0.1 vmax) above the upper limit, mirrored below the lower one."""
    limits = limits_at_distances(
        [5.0, -outside], [-outside, 5.0], velocity=(-v_down, v_up), acceleration=acceleration
    )
    box = velocity_box(limits, None, dt, braking)
    assert box.upper[0] == pytest.approx(max(-outside / dt, -0.1 * v_down))
    assert box.lower[1] == pytest.approx(min(outside / dt, 0.1 * v_up))
    assert np.all(box.lower <= box.upper)


def test_the_way_back_begins_as_fast_as_acceleration_limits_allow() -> None:
    """From rest 0.3 rad outside, 2 rad/s and 10 rad/s^2 in force: -0.1, -0.2, -0.2 ... rad/s."""
    limits = limits_at_distances([5.0], [-0.3], velocity=2.0, acceleration=10.0)
    for v_prev, asked in ((0.0, -0.1), (-0.1, -0.2), (-0.2, -0.2), (-1.0, -0.9)):
        box = velocity_box(limits, np.array([v_prev]), 0.01)
        assert box.upper == pytest.approx([asked])
        assert box.lower == pytest.approx([v_prev - 0.1])
        assert box.relaxed == 0


def test_no_joint_moves_farther_out_whatever_its_acceleration() -> None:
    """Outwards at 1 rad/s, 10 rad/s^2 in force: it stops at once, which is counted."""
    limits = limits_at_distances([5.0], [-0.3], velocity=2.0, acceleration=10.0)
    box = velocity_box(limits, np.ones(1), 0.01)
    assert [*box.lower, *box.upper, box.relaxed] == [0.0, 0.0, 1]


@pytest.mark.parametrize("braking", BRAKINGS)
@pytest.mark.parametrize("velocity", [None, 40.0])
def test_the_way_back_does_not_run_through_the_other_limit(
    braking: Braking, velocity: float | None
) -> None:
    """In a narrow range the brake before the far limit bounds the way back: never lower > upper."""
    limits = limits_at_distances([0.31, -0.3], [-0.3, 0.31], velocity=velocity, acceleration=0.5)
    box = velocity_box(limits, None, 0.01, braking, position_gain=0.1)
    assert np.all(box.lower <= box.upper)
    assert box.upper[0] < 0 < box.lower[1]


def test_the_way_back_without_velocity_limits_takes_one_step() -> None:
    """Hi = d/dt then: there is no speed to bound it by."""
    box = velocity_box(limits_at_distances([5.0, -0.1], [-0.3, 5.0]), None, 0.01)
    assert box.upper[0] == pytest.approx(-30.0)
    assert box.lower[1] == pytest.approx(10.0)


@pytest.mark.parametrize("braking", BRAKINGS)
@pytest.mark.parametrize("v_prev", [None, np.array([0.3, -0.3, 0.0])], ids=["none", "given"])
def test_infinite_limits_never_give_nan(braking: Braking, v_prev: Array | None) -> None:
    """Continuous joints, no velocity limit, no acceleration limit, in any mixture."""
    inf = np.inf
    for to_lower, to_upper, velocity, acceleration in (
        ([inf, inf, 0.1], [inf, 0.1, inf], None, None),
        ([inf, inf, 0.1], [inf, 0.1, inf], inf, inf),
        ([inf, inf, 0.1], [inf, 0.1, inf], [inf, 1.0, inf], [5.0, inf, 5.0]),
        ([inf, -0.1, 5.0], [inf, 5.0, -0.1], inf, 5.0),
        ([inf, -0.1, 5.0], [inf, 5.0, -0.1], None, inf),
    ):
        limits = limits_at_distances(
            to_lower, to_upper, velocity=velocity, acceleration=acceleration
        )
        box = velocity_box(limits, v_prev, 0.01, braking)
        assert not np.isnan(box.lower).any()
        assert not np.isnan(box.upper).any()
        assert np.all(box.lower <= box.upper)


def test_without_any_limit_the_box_is_infinite() -> None:
    """Nothing in force bounds nothing."""
    joint = JointLimits(2, np.arange(2), None, None, None, None)
    box = velocity_box(joint.at(np.zeros(2)), np.ones(2), 0.01)
    assert np.array_equal(box.upper, [np.inf, np.inf])
    assert np.array_equal(box.lower, [-np.inf, -np.inf])


def test_without_position_limits_the_others_remain() -> None:
    """Velocity and acceleration limits do not need position limits."""
    joint = JointLimits(1, np.zeros(1, int), None, interval_of(2.0, 1), interval_of(5.0, 1), None)
    box = velocity_box(joint.at(np.zeros(1)), np.array([1.98]), 0.01)
    assert box.upper == pytest.approx([2.0])
    assert box.lower == pytest.approx([1.93])


@settings(deadline=None, max_examples=300)
@given(
    below=st.floats(-0.5, 3.0),
    range_=st.floats(1e-3, 5.0),
    vmax=speeds,
    acceleration=st.one_of(st.none(), accelerations),
    v_prev=st.floats(-20, 20),
    dt=periods,
    braking=st.sampled_from(BRAKINGS),
)
def test_the_box_is_sound_at_any_state(
    below: float,
    range_: float,
    vmax: float,
    acceleration: float | None,
    v_prev: float,
    dt: float,
    braking: Braking,
) -> None:
    """Whatever came before: bounds in order, inside vmax, and no limit is passed from inside."""
    above = range_ - below
    limits = limits_at_distances(below, above, velocity=vmax, acceleration=acceleration)
    box = velocity_box(limits, np.array([v_prev]), dt, braking)
    assert -vmax <= box.lower <= box.upper <= vmax
    assert box.relaxed in {0, 1}
    for v in (float(box.lower[0]), float(box.upper[0])):
        if below >= 0 and above >= 0:
            assert -below - 1e-12 <= v * dt <= above + 1e-12
    if acceleration is not None and not box.relaxed:
        reach = acceleration * dt + 1e-8
        assert v_prev - reach <= box.lower
        assert box.upper <= v_prev + reach


def test_an_unknown_braking_names_the_valid_ones() -> None:
    """A typing error is an error with the nearest match, not a silent default."""
    with pytest.raises(DikbenchError, match=r"'viabel'; did you mean 'viable'\? valid: gain"):
        velocity_box(limits_at_distances(1.0, 1.0), None, 0.01, "viabel")  # type: ignore[arg-type]
