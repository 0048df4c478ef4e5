"""Placements at many times at once are those of each time."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pinocchio as pin
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.linalg import expm

from dikbench.arrays import Array
from dikbench.errors import DikbenchError
from dikbench.robots.loading import load_robot
from dikbench.scenario.reference.curves import circle, lemniscate
from dikbench.scenario.reference.reference import (
    Reference,
    along_screw,
    joint_path,
    screw_path,
    target_at_rest,
)
from dikbench.scenario.reference.screws import exp3, exp6
from dikbench.scenario.reference.spline import spline_through
from dikbench.scenario.reference.waypoints import held, through

CORNERS = [0.0, 0.3, 0.35, 1.1, 1.5]


def drawn_placements(random: np.random.Generator, count: int) -> list[pin.SE3]:
    """Draw placements, turned by up to 1.5 rad from one to the next; two of them are the same."""
    placed = [pin.exp6(pin.Motion(random.uniform(-1, 1, 6)))]
    for _ in range(count - 2):
        placed.append(placed[-1] * pin.exp6(pin.Motion(0.85 * random.uniform(-1, 1, 6))))
    return [*placed, placed[-1]]


def joint_motion(random: np.random.Generator) -> Reference:
    """Move the joints of an arm at a constant rate."""
    robot = load_robot("ur5")
    v = random.normal(size=robot.nv)
    return joint_path(robot, lambda tau: robot.q0 + tau * v, lambda tau: v, 1.5)


MADE: dict[str, Callable[[np.random.Generator], Reference]] = {
    "rest": lambda random: target_at_rest(drawn_placements(random, 2)[0], 1.5),
    "screw": lambda random: screw_path(
        drawn_placements(random, 2)[0], 3 * random.normal(size=6), 1.5
    ),
    "slide": lambda random: screw_path(
        drawn_placements(random, 2)[0], np.append(random.normal(size=3), np.zeros(3)), 1.5
    ),
    "fold": lambda random: along_screw(
        drawn_placements(random, 2)[0],
        random.normal(size=6),
        lambda tau: 0.01 + 0.3 * abs(tau - 0.75),
        lambda tau: float(np.sign(tau - 0.75)),
        1.5,
    ),
    "screws": lambda random: through(CORNERS, drawn_placements(random, 5), smooth=False),
    "smooth screws": lambda random: through(CORNERS, drawn_placements(random, 5), smooth=True),
    "spline": lambda random: spline_through(CORNERS, drawn_placements(random, 5)),
    "held": lambda random: held(CORNERS, drawn_placements(random, 5)),
    "circle": lambda random: circle(drawn_placements(random, 2)[0], 0.1, 0.7, 2.0, turn=0.4),
    "eight": lambda random: lemniscate(drawn_placements(random, 2)[0], 0.2, 0.7, 2.0),
    "joints": joint_motion,
}


@pytest.mark.parametrize("name", MADE)
@settings(max_examples=10)
@given(st.integers(0, 2**32 - 1), st.lists(st.floats(-0.5, 2.0), max_size=6))
def test_many_times_are_each_of_them(name: str, seed: int, more: list[float]) -> None:
    """At corners, and next to them, before the start and after the end as well."""
    reference = MADE[name](np.random.default_rng(seed))
    beside = [at + step for at in CORNERS for step in (0.0, 1e-10, -1e-10)]
    times = np.array([*more, *beside])
    rotations, translations = reference.placements(times)
    targets = reference.targets(times)
    expected = np.array([reference.placement(tau).homogeneous for tau in times.tolist()])
    assert np.abs(rotations - expected[:, :3, :3]).max() < 1e-13
    assert np.abs(translations - expected[:, :3, 3]).max() < 1e-13
    assert np.abs(np.array([X.homogeneous for X in targets]) - expected).max() < 1e-13


@pytest.mark.parametrize("name", MADE)
def test_no_times_are_no_placements(name: str) -> None:
    """With the shapes that the others have."""
    reference = MADE[name](np.random.default_rng(0))
    rotations, translations = reference.placements(np.empty(0))
    assert (rotations.shape, translations.shape) == ((0, 3, 3), (0, 3))
    assert list(reference.targets(np.empty(0))) == []


def test_a_function_of_one_time_is_asked_for_each() -> None:
    """As those that the author of a family writes."""
    first = pin.SE3.Identity()
    reference = Reference(
        1.0, lambda tau: pin.SE3(first.rotation, np.full(3, tau)), lambda tau: np.zeros(6)
    )
    rotations, translations = reference.placements(np.array([0.1, 0.7]))
    assert np.array_equal(rotations, [np.eye(3)] * 2)
    assert np.array_equal(translations, [[0.1] * 3, [0.7] * 3])
    assert [X.translation[0] for X in reference.targets(np.array([0.1, 0.7]))] == [0.1, 0.7]


def test_what_is_no_rotation_is_an_error() -> None:
    """Of a function of one time, and of one of many."""
    scaled = pin.SE3.Identity()
    scaled.rotation = np.diag([1.0, 1.0, 1.001])
    for reference in (
        target_at_rest(scaled, 1.0),
        along_screw(scaled, np.zeros(6), lambda tau: 0.0 * tau, lambda tau: 0.0, 1.0),
    ):
        with pytest.raises(DikbenchError, match=r"^reference: target: .* is not a rotation"):
            reference.targets(np.array([0.5]))


@given(st.integers(0, 2**32 - 1), st.floats(-12.0, 0.5))
def test_exponentials_are_those_of_matrices(seed: int, size: float) -> None:
    """Of angles from 1e-12 to 3 rad and more, and none; by Pade approximants."""
    random = np.random.default_rng(seed)
    angular = 10**size * random.normal(size=(4, 3))
    angular[3] = 0.0
    twists: Array = np.hstack([random.normal(size=(4, 3)), angular])
    rotations, translations = exp6(twists)
    assert np.array_equal(exp3(angular), rotations)
    for twist, R, p in zip(twists, rotations, translations, strict=True):
        matrix = np.zeros((4, 4))
        matrix[:3, :3], matrix[:3, 3] = pin.skew(twist[3:]), twist[:3]
        expected = expm(matrix)
        assert np.abs(R - expected[:3, :3]).max() < 1e-13
        assert np.abs(p - expected[:3, 3]).max() < 1e-13
