"""Capsules around points: none outside, and hardly larger than it has to be."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from dikbench.arrays import Array
from dikbench.robots.collision.enclosing_capsule import enclosing_capsule


def beyond(points: Array, start: Array, end: Array, radius: float) -> Array:
    """How far points (n, 3) are outside a capsule, negative inside, (n,)."""
    way = end - start
    length = float(way @ way)
    t = np.zeros(len(points)) if length == 0 else np.clip((points - start) @ way / length, 0, 1)
    away: Array = np.linalg.norm(points - start - t[:, None] * way, axis=1)
    return away - radius


@given(seed=st.integers(0, 10**6), count=st.integers(2, 60), flat=st.integers(0, 3))
def test_no_point_is_outside(seed: int, count: int, flat: int) -> None:
    """Clouds of any shape: round, long, flat, on a line, and (almost) one point."""
    random = np.random.default_rng(seed)
    sizes = 10.0 ** random.uniform(-3, 0, 3)
    sizes[:flat] = 0.0
    turn = np.linalg.qr(random.normal(size=(3, 3)))[0]
    points = random.uniform(-1, 1, 3) + random.normal(size=(count, 3)) * sizes @ turn
    assert beyond(points, *enclosing_capsule(points)).max() <= 0


@pytest.mark.parametrize("length", [0.0, 0.1, 0.5])
def test_points_of_a_capsule_give_it_back(length: float) -> None:
    """On its surface, in any direction: radius and length to a few per cent."""
    random = np.random.default_rng(3)
    unit = random.normal(size=(4000, 3))
    unit /= np.linalg.norm(unit, axis=1, keepdims=True)
    along = random.uniform(-0.5, 0.5, 4000)
    caps = np.abs(along) > 0.4
    ring = unit * [1, 1, 0] / np.linalg.norm(unit[:, :2], axis=1, keepdims=True)
    offset = np.where(caps, np.sign(unit[:, 2]) / 2, along) * length
    surface = np.where(caps[:, None] | (length == 0), unit, ring) * 0.08
    turn = np.linalg.qr(random.normal(size=(3, 3)))[0]
    points = (surface + offset[:, None] * [0, 0, 1]) @ turn + [0.3, -0.2, 0.1]
    start, end, radius = enclosing_capsule(points)
    assert radius == pytest.approx(0.08, rel=0.05)
    assert np.linalg.norm(end - start) == pytest.approx(length, abs=0.012)
