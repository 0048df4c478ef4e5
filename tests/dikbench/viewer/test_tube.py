"""A tube about a path, by its closed forms."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from dikbench.arrays import Array
from dikbench.viewer.tube import RING, tube


@given(st.lists(st.sampled_from([*np.eye(3), *-np.eye(3), np.ones(3)]), min_size=1, max_size=30))
def test_a_tube_is_about_its_path(steps: list[Array]) -> None:
    """Each ring is round about its point of the path, also where it turns back or off at once."""
    path = np.cumsum([np.zeros(3), *steps], axis=0)
    count = len(path)
    made = tube(path, 0.1)
    assert made is not None
    rings = made.vertices.reshape(count, RING, 3)
    np.testing.assert_allclose(rings.mean(axis=1), path, atol=1e-9)
    np.testing.assert_allclose(np.linalg.norm(rings - path[:, None], axis=2), 0.1, atol=1e-9)


def test_the_area_of_a_straight_tube() -> None:
    """Its triangles cover the mantle of a prism, and face outwards; standing still adds nothing."""
    path = np.array([[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [1.0, 0.0, 0.0], [3.0, 0.0, 0.0]])
    made = tube(path, 0.5)
    assert made is not None
    a, b, c = np.moveaxis(made.vertices[made.faces], 1, 0)
    normals = np.cross(b - a, c - a) / 2
    perimeter = 2 * RING * 0.5 * np.sin(np.pi / RING)
    assert np.linalg.norm(normals, axis=1).sum() == pytest.approx(3 * perimeter)
    away = (a + b + c) / 3 * [0, 1, 1]
    assert (np.einsum("ij,ij->i", normals, away) > 0).all()
    assert tube(path[1:3], 0.5) is None
