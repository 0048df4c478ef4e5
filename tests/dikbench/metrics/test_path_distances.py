"""Distances of points from a reference path, against minimisation over the curve."""

from __future__ import annotations

import numpy as np
import pinocchio as pin
import pytest
from makers.frame_motions import (
    DT,
    EIGHT,
    ROUND,
)
from scipy.optimize import minimize_scalar

from dikbench.arrays import Array
from dikbench.scenario.reference.path import ReferencePath, reference_path
from dikbench.scenario.reference.reference import Reference


@pytest.mark.parametrize("seed", range(4))
def test_distances_are_the_least_over_the_curve(seed: int) -> None:
    """Points about a circle, a figure of eight and a polygon, against minimisation over time."""
    random = np.random.default_rng(seed)
    corners = random.uniform(-0.2, 0.2, (6, 3))
    polygon = Reference(
        5.0,
        lambda tau: pin.SE3(
            np.eye(3),
            np.array([np.interp(tau, np.arange(6), corners[:, axis]) for axis in range(3)]),
        ),
        lambda tau: np.zeros(6),
    )
    for reference in (ROUND, EIGHT, polygon):
        path = reference_path(reference, DT)
        points = np.array(
            [reference.placement(tau).translation for tau in random.uniform(0, 4, 12)]
        )
        points += random.normal(size=(12, 3)) * random.choice([1e-5, 1e-3, 0.1], size=(12, 1))
        points[0] = [0.0, 0.0, 0.1]  # the centre of the circle: every point is the nearest
        expected = [least_distance(reference, point) for point in points]
        np.testing.assert_allclose(path.distances(points), expected, atol=3e-6)


def test_the_nearest_piece_may_end_farther_away_than_many_vertices() -> None:
    """The middle of a long piece, 1 mm away, among short ones at more than 1.2 mm."""
    short = np.array([[0.0, 2.2e-3 + 1e-5 * k, 0.0] for k in range(40)])
    vertices = np.vstack([[[-2.5e-3, 0, 0], [2.5e-3, 0, 0]], short])
    path = ReferencePath(vertices, len(vertices) - 1)
    assert path.distances(np.array([[-5e-4, 1e-3, 0.0]])) == pytest.approx(1e-3, abs=1e-12)


def least_distance(reference: Reference, point: Array) -> float:
    """From a point to the curve, by samples and golden sections about the best of them."""
    instants = np.linspace(0, reference.duration, 1001)

    def away(tau: float) -> float:
        return float(np.linalg.norm(reference.placement(tau).translation - point))

    best = instants[np.argsort([away(tau) for tau in instants.tolist()])[:8]]
    step = instants[1]
    return min(
        float(
            minimize_scalar(
                away, bounds=(tau - step, tau + step), method="bounded", options={"xatol": 1e-9}
            ).fun
        )
        for tau in np.clip(best, step, reference.duration - step).tolist()
    )
