"""Limits of joints: their forms, their errors, and what "infinite" means."""

from __future__ import annotations

import sys

import numpy as np
import pytest

from dikbench.arrays import Array
from dikbench.errors import DikbenchError
from dikbench.robots.limits import Interval, JointLimits
from dikbench.robots.loading import load_robot
from dikbench.robots.robot import Robot

KINDS = ("position", "velocity", "acceleration", "effort")
DBL_MAX = sys.float_info.max


@pytest.fixture
def arm() -> Robot:
    """A planar arm of three joints."""
    return load_robot("planar3r")


def _bounds(robot: Robot, kind: str) -> tuple[Array, Array]:
    interval: Interval = getattr(robot.limits, kind)
    return interval.lower, interval.upper


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize(
    ("given", "lower", "upper"),
    [
        (2, [-2, -2, -2], [2, 2, 2]),
        ([1, 2, 3], [-1, -2, -3], [1, 2, 3]),
        (np.array([1.0, 2.0, 3.0]), [-1, -2, -3], [1, 2, 3]),
        ((-1, 2), [-1, -1, -1], [2, 2, 2]),
        (([-1, -2, 0], 3), [-1, -2, 0], [3, 3, 3]),
        ((-np.inf, [1, np.inf, 3]), [-np.inf] * 3, [1, np.inf, 3]),
    ],
    ids=["magnitude", "list", "array", "pair", "mixed-pair", "infinite"],
)
def test_every_form_of_a_limit_is_a_lower_and_an_upper_bound_per_joint(
    arm: Robot, kind: str, given: object, lower: list[float], upper: list[float]
) -> None:
    """A magnitude is symmetric, a tuple is (lower, upper), each a number or one per joint."""
    got_lower, got_upper = _bounds(arm.with_limits(**{kind: given}), kind)
    assert np.array_equal(got_lower, lower)
    assert np.array_equal(got_upper, upper)


@pytest.mark.parametrize("kind", KINDS)
def test_none_takes_a_limit_out_of_force(arm: Robot, kind: str) -> None:
    """None means not in force, for any kind, and leaves the other kinds alone."""
    full = arm.with_limits(position=2.0, velocity=2.0, acceleration=2.0, effort=2.0)
    bare = full.with_limits(**{kind: None})
    assert getattr(bare.limits, kind) is None
    for other in set(KINDS) - {kind}:
        assert getattr(bare.limits, other) is getattr(full.limits, other)


def test_with_limits_leaves_the_robot_it_was_asked_of(arm: Robot) -> None:
    """A robot is a value: new limits are a new robot, kinds that are not named stay."""
    before = arm.limits
    other = arm.with_limits(velocity=0.5)
    assert arm.limits is before
    assert other.limits.position is before.position
    assert other.model is arm.model
    assert arm.with_limits().limits is before


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("huge", [DBL_MAX, 1.1e20, np.inf])
def test_the_largest_double_means_no_limit(arm: Robot, kind: str, huge: float) -> None:
    """Magnitudes above 1e20 are infinite; those below are limits."""
    lower, upper = _bounds(arm.with_limits(**{kind: [huge, 0.9e20, 1.0]}), kind)
    assert np.array_equal(upper, [np.inf, 0.9e20, 1.0])
    assert np.array_equal(lower, [-np.inf, -0.9e20, -1.0])


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize(
    ("wrong", "message"),
    [
        ([1, 2], r"expected a number or 3 numbers without NaN, got shape \(2,\)"),
        (np.ones((3, 1)), r"expected a number or 3 numbers without NaN, got shape \(3, 1\)"),
        (float("nan"), r"expected a number or 3 numbers without NaN"),
        ([1, float("nan"), 1], r"expected a number or 3 numbers without NaN"),
        ("fast", r"expected numbers, got 'fast'"),
        ([1, [2], 3], r"expected numbers, got \[1, \[2\], 3\]"),
        ((-1, 0, 1), r"a tuple means \(lower, upper\), got 3 entries"),
        ((2, 1), r"a lower bound is above its upper bound"),
        (-1, r"a lower bound is above its upper bound"),
    ],
)
def test_wrong_limits_are_errors_of_one_line(
    arm: Robot, kind: str, wrong: object, message: str
) -> None:
    """The message names the kind of limit, what was wrong and what would have been valid."""
    with pytest.raises(DikbenchError, match=rf"^{kind} limit: {message}") as caught:
        arm.with_limits(**{kind: wrong})
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize("kind", ["velocity", "acceleration", "effort"])
@pytest.mark.parametrize("interval", [(0.1, 1), (-2, [1, -1, 1])])
def test_bounds_that_exclude_rest_are_errors(arm: Robot, kind: str, interval: object) -> None:
    """A robot that may not stand still is a mistake; a range of positions without zero is not."""
    with pytest.raises(DikbenchError, match="every interval must contain zero"):
        arm.with_limits(**{kind: interval})
    assert np.array_equal(_bounds(arm.with_limits(position=(0.1, 1)), "position")[0], [0.1] * 3)


def test_distances_are_measured_to_both_sides(arm: Robot) -> None:
    """to_lower = q - q_min and to_upper = q_max - q, negative outside."""
    limits = arm.with_limits(position=(-1.0, [2.0, 0.5, np.inf])).limits
    seen = limits.at(np.array([0.5, 1.0, -1.5]))
    assert seen.to_lower == pytest.approx([1.5, 2.0, -0.5])
    assert seen.to_upper == pytest.approx([1.5, -0.5, np.inf])
    assert seen.joint is limits


def test_without_position_limits_there_are_no_distances(arm: Robot) -> None:
    """None stays None, it does not become infinity."""
    seen = arm.with_limits(position=None).limits.at(arm.q0)
    assert seen.to_lower is None
    assert seen.to_upper is None


def test_the_way_back_is_a_tenth_of_the_velocity_towards_the_inside(arm: Robot) -> None:
    """(up from below, down from above), each from its own side of the velocity limit."""
    way_back = arm.with_limits(velocity=(-3.0, 2.0)).limits.way_back
    assert way_back is not None
    up, down = way_back
    assert up == pytest.approx([0.2] * 3)
    assert down == pytest.approx([0.3] * 3)
    assert arm.with_limits(velocity=None).limits.way_back is None


def test_a_joint_without_a_coordinate_cannot_get_a_position_limit() -> None:
    """Velocity 1 has no coordinate of its own: only infinity is valid there."""
    limits = JointLimits(3, np.array([0, -1, 1]), None, None, None, None)
    allowed = limits.with_interval("position", [1.0, np.inf, 2.0])
    assert allowed.at(np.array([0.25, 0.5])).to_upper == pytest.approx([0.75, np.inf, 1.5])
    with pytest.raises(DikbenchError, match=r"can have none; expected inf at \[1\]"):
        limits.with_interval("position", 1.0)
    with pytest.raises(DikbenchError, match=r"can have none; expected inf at \[1\]"):
        limits.with_interval("position", (-np.inf, [1.0, 1.0, np.inf]))


def test_usage_is_the_share_of_the_bound_on_the_own_side() -> None:
    """1 on either bound, 0 at rest and for infinite bounds, infinite past a bound of zero."""
    interval = Interval(np.array([-1.0, -np.inf, 0.0]), np.array([2.0, np.inf, 4.0]))
    values = np.array([[2.0, 5.0, 4.0], [-1.0, -5.0, 0.0], [0.5, 0.0, 1.0], [-2.0, 0.0, -1.0]])
    expected = [[1.0, 0.0, 1.0], [1.0, 0.0, 0.0], [0.25, 0.0, 0.25], [2.0, 0.0, np.inf]]
    assert np.array_equal(interval.usage(values), expected)
