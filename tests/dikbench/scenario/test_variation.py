"""What a seed changes: inside the declared ranges, each part by itself, seed 0 nothing."""

from __future__ import annotations

import numpy as np
import pinocchio as pin
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from dikbench.errors import DikbenchError
from dikbench.robots.loading import load_robot
from dikbench.scenario.variation import NO_VARIATION, Perturbation, Variation

RANGES = Variation(start=0.2, direction=0.5, timing=0.1)


@pytest.mark.parametrize("change", [RANGES.drawn(0), NO_VARIATION.drawn(7)])
def test_seed_zero_and_empty_ranges_change_nothing(change: Perturbation) -> None:
    """To the bit."""
    robot = load_robot("panda")
    assert np.array_equal(change.posture(robot, robot.q0), robot.q0)
    assert np.array_equal(change.rotation(robot), np.eye(3))
    assert change.pace == 1.0


@settings(deadline=None)
@given(seed=st.integers(1, 10**6))
def test_a_seed_stays_in_the_declared_ranges(seed: int) -> None:
    """Joints, angle and timing; a fixed joint stays where it is."""
    robot, change = load_robot("kinova"), RANGES.drawn(seed)
    step = pin.difference(robot.model, robot.q0, change.posture(robot, robot.q0, (1, 4)))
    assert np.abs(step).max() <= 0.2 + 1e-12
    assert np.abs(step[[1, 4]]).max() < 1e-12
    assert np.abs(step[[0, 2, 3, 5]]).min() > 0
    assert 0 < np.linalg.norm(pin.log3(change.rotation(robot))) <= 0.5
    assert 0 < abs(change.pace - 1) <= 0.1


def test_seeds_and_parts_are_independent() -> None:
    """Two seeds differ, one seed repeats itself, and one range does not move another's draw."""
    robot = load_robot("panda")
    first, again, other = RANGES.drawn(3), RANGES.drawn(3), RANGES.drawn(4)
    q = first.posture(robot, robot.q0)
    assert np.array_equal(q, again.posture(robot, robot.q0))
    assert np.abs(q - other.posture(robot, robot.q0)).max() > 1e-3
    assert Variation(timing=0.1).drawn(3).pace == first.pace


def test_a_planar_arm_is_turned_in_its_plane() -> None:
    """About z only."""
    rotation = RANGES.drawn(5).rotation(load_robot("planar3r"))
    assert rotation[2] == pytest.approx([0, 0, 1])
    assert abs(rotation[0, 1]) > 1e-3


def test_a_negative_seed_is_an_error() -> None:
    """Random generators take none."""
    with pytest.raises(DikbenchError, match="seed -1 must not be negative"):
        RANGES.drawn(-1)


def test_the_ranges_in_words() -> None:
    """Only those that are there."""
    assert str(Variation(start=0.1)) == "start by up to 0.1 rad per joint"
    assert str(NO_VARIATION) == "nothing"
    assert "timing by up to 10 %" in str(RANGES)
