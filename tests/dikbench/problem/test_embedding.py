"""The embedding: distances of points are d6, and what is not asked for does not count."""

from __future__ import annotations

import numpy as np
import pinocchio as pin
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from dikbench.problem.embedding import Embedding, embedding_of
from dikbench.problem.tasks import OrientationTask, PoseTask, PositionTask
from dikbench.robots.loading import load_robot

PANDA, PLANAR = load_robot("panda"), load_robot("planar3r")
SEEDS = st.integers(0, 2**32 - 1)


def pose(random: np.random.Generator, spread: float = 1.0) -> pin.SE3:
    """Somewhere."""
    turn = pin.exp3(spread * random.normal(size=3))
    return pin.SE3(turn, spread * random.normal(size=3))


def distance(embedding: Embedding, X: pin.SE3, Y: pin.SE3) -> float:
    """Of two placements, as points."""
    rotations = np.array([X.rotation, Y.rotation])
    x, y = embedding.points(rotations, np.array([X.translation, Y.translation]))
    return float(np.linalg.norm(x - y))


@settings(max_examples=60, deadline=None)
@given(seed=SEEDS, spread=st.sampled_from([1e-3, 0.1, 1.0]), length=st.sampled_from([0.1, 0.5]))
def test_the_distance_of_points_is_that_of_poses(seed: int, spread: float, length: float) -> None:
    """The root of |dp|^2 + (2 L sin(theta/2))^2; of positions and of orientations their part."""
    random = np.random.default_rng(seed)
    X, Y = pose(random, spread), pose(random, spread)
    dp = float(np.linalg.norm(X.translation - Y.translation))
    theta = float(np.linalg.norm(pin.log3(X.rotation.T @ Y.rotation)))
    turned = 2 * length * np.sin(theta / 2)
    for task, expected in (
        (PoseTask(), np.hypot(dp, turned)),
        (PositionTask(), dp),
        (OrientationTask(), turned),
    ):
        embedding = embedding_of(task, PANDA, X.rotation, length)
        assert distance(embedding, X, Y) == pytest.approx(expected, rel=1e-6, abs=1e-9)


@settings(max_examples=40, deadline=None)
@given(seed=SEEDS, axis=st.integers(0, 2))
def test_a_rigid_motion_of_the_world_changes_no_distance(seed: int, axis: int) -> None:
    """With all rows, and with one of the rotation or of the translation left out."""
    random = np.random.default_rng(seed)
    X, Y, W = pose(random), pose(random), pose(random)
    weights = np.ones(6)
    for left_out in (None, axis, 3 + axis):
        if left_out is not None:
            weights = np.ones(6)
            weights[left_out] = 1e-4
        task = PoseTask(weight=weights)
        before = distance(embedding_of(task, PANDA, X.rotation), X, Y)
        after = distance(embedding_of(task, PANDA, (W * X).rotation), W * X, W * Y)
        assert after == pytest.approx(before, abs=1e-9)


@pytest.mark.parametrize("axis", range(3))
def test_a_free_axis_of_the_target_is_free(axis: int) -> None:
    """Turned about it nothing is lost; tilted, the angle of the axes counts."""
    weights = np.ones(6)
    weights[3 + axis] = 5e-4
    X = pose(np.random.default_rng(axis))
    embedding = embedding_of(PoseTask(weight=weights), PANDA, X.rotation)
    for k in range(3):
        turned = X * pin.SE3(pin.exp3(0.7 * np.eye(3)[k]), np.zeros(3))
        expected = 0.0 if k == axis else 2 * 0.2 * np.sin(0.35)
        assert distance(embedding, X, turned) == pytest.approx(expected, abs=1e-12)


def test_an_arm_in_the_plane_has_two_coordinates_and_an_angle() -> None:
    """What it cannot move does not count; rows of negligible weight do not either."""
    X = pin.SE3(pin.utils.rotate("z", 0.3), np.array([0.1, 0.2, 0.0]))
    Y = pin.SE3(pin.utils.rotate("z", 0.8), np.array([0.4, 0.6, 0.7]))
    whole = embedding_of(PoseTask(), PLANAR, X.rotation)
    assert distance(whole, X, Y) == pytest.approx(np.hypot(0.5, 0.4 * np.sin(0.25)))
    light = embedding_of(PoseTask(weight=np.array([1.0, 1.0, 9e-4])), PLANAR, X.rotation)
    assert distance(light, X, Y) == pytest.approx(0.5)
    kept = embedding_of(PoseTask(weight=np.array([1.0, 1.0, 1e-3])), PLANAR, X.rotation)
    assert distance(kept, X, Y) == pytest.approx(np.hypot(0.5, 0.4 * np.sin(0.25)))
