"""Closed curves: their implicit equations, their rates, and how the frame turns."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pinocchio as pin
import pytest

from dikbench.arrays import Array
from dikbench.robots.loading import load_robot
from dikbench.scenario.reference.curves import (
    WORLD_XY_PLANE,
    WORLD_YZ_PLANE,
    circle,
    lemniscate,
    plane_of,
)
from dikbench.scenario.reference.reference import Reference

START = pin.SE3(pin.exp3(np.array([0.4, -0.7, 1.1])), np.array([0.5, -0.2, 0.3]))
PLANES = (WORLD_YZ_PLANE, WORLD_XY_PLANE, pin.exp3(np.array([0.3, 0.2, -0.5])) @ WORLD_YZ_PLANE)

Curve = Callable[..., Reference]


def _offsets(reference: Reference, plane: Array) -> Array:
    """In the axes of the plane and its normal, (k, 3)."""
    axes = np.column_stack([plane, np.cross(plane[:, 0], plane[:, 1])])
    taus = np.linspace(0.0, reference.duration, 57)
    return np.array([(reference.placement(t).translation - START.translation) @ axes for t in taus])


@pytest.mark.parametrize("plane", PLANES)
def test_a_circle_keeps_its_distance_from_its_centre(plane: Array) -> None:
    """x^2 + (y - r)^2 = r^2 in the plane, and nothing across it."""
    x, y, z = _offsets(circle(START, 0.1, 2.0, 1.3, plane=plane), plane).T
    assert x**2 + (y - 0.1) ** 2 == pytest.approx(np.full(len(x), 0.01))
    assert np.abs(z).max() < 1e-12
    assert y.max() == pytest.approx(0.2, rel=1e-2)


@pytest.mark.parametrize("plane", PLANES)
def test_a_lemniscate_is_geronos(plane: Array) -> None:
    """a^2 y^2 = x^2 (a^2 - x^2): as wide to both sides, half as high."""
    x, y, z = _offsets(lemniscate(START, 0.1, 2.0, 1.0, plane=plane), plane).T
    assert 0.01 * y**2 == pytest.approx(x**2 * (0.01 - x**2), abs=1e-15)
    assert np.abs(z).max() < 1e-12
    assert (x.min(), x.max()) == pytest.approx((-0.1, 0.1), rel=1e-3)
    assert (y.min(), y.max()) == pytest.approx((-0.05, 0.05), rel=1e-2)


@pytest.mark.parametrize("plane", PLANES)
@pytest.mark.parametrize("turn", [0.0, 0.4])
@pytest.mark.parametrize("curve", [circle, lemniscate])
def test_velocity_is_the_derivative_of_the_placement(
    curve: Curve, turn: float, plane: Array
) -> None:
    """The body twist, by central differences."""
    reference, h = curve(START, 0.1, 2.0, 1.5, plane=plane, turn=turn), 1e-5
    for tau in (0.1, 0.77, 1.3, 2.9):
        before, after = reference.placement(tau - h), reference.placement(tau + h)
        twist = pin.log6(before.actInv(after)).np / (2 * h)
        assert reference.velocity(tau) == pytest.approx(twist, abs=1e-8)


@pytest.mark.parametrize("curve", [circle, lemniscate])
def test_every_lap_comes_back_to_the_start(curve: Curve) -> None:
    """Position and orientation, at the period and twice that."""
    reference = curve(START, 0.1, 2.0, 2.0, turn=0.4)
    assert reference.duration == 4.0
    for tau in (0.0, 2.0, 4.0):
        assert START.isApprox(reference.placement(tau), 1e-12)


@pytest.mark.parametrize("curve", [circle, lemniscate])
def test_the_frame_turns_about_the_normal_by_the_angle_given(curve: Curve) -> None:
    """About the world's x axis for an upright curve: by `turn` at a quarter of a lap."""
    reference = curve(START, 0.1, 2.0, 1.0, turn=0.4)
    quarter = reference.placement(0.5).rotation @ START.rotation.T
    assert pin.log3(quarter) == pytest.approx(np.array([0.4, 0.0, 0.0]))
    still = curve(START, 0.1, 2.0, 1.0)
    assert np.array_equal(still.placement(0.5).rotation, START.rotation)


def test_planar_arms_keep_to_their_plane() -> None:
    """Their curves are in x-y; those of arms in space stand upright."""
    assert plane_of(load_robot("planar4r")) is WORLD_XY_PLANE
    assert plane_of(load_robot("ur5")) is WORLD_YZ_PLANE
