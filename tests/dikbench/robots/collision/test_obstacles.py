"""Obstacles: what is drawn of them is their surface."""

from __future__ import annotations

import numpy as np
import pinocchio as pin
import pytest

from dikbench import BoxObstacle, CapsuleObstacle, SphereObstacle
from dikbench.report.drawing.obstacle_surface import surface
from dikbench.robots.collision.obstacles import Obstacle

TURNED = tuple(map(tuple, pin.utils.rpyToMatrix(0.3, -0.5, 0.8).tolist()))
OBSTACLES: list[Obstacle] = [
    SphereObstacle((0.1, -0.2, 0.3), 0.2),
    CapsuleObstacle((0.1, 0.2, 0.3), (0.4, -0.1, 0.2), 0.07),
    CapsuleObstacle((0, 0, 0.5), (0, 0, -0.5), 0.1),
    BoxObstacle((0.3, 0.1, -0.2), (0.2, 0.3, 0.4), TURNED),
]


def depth(obstacle: Obstacle, point: np.ndarray) -> float:
    """Signed distance from the surface along the shape's own norm, 0 on it, by formulas."""
    if isinstance(obstacle, SphereObstacle):
        return float(np.linalg.norm(point - obstacle.centre)) - obstacle.radius
    if isinstance(obstacle, CapsuleObstacle):
        start, way = np.array(obstacle.start), np.subtract(obstacle.end, obstacle.start)
        t = np.clip((point - start) @ way / (way @ way), 0, 1)
        return float(np.linalg.norm(point - start - t * way)) - obstacle.radius
    inside = np.array(obstacle.rotation).T @ (point - obstacle.centre)
    return float((np.abs(inside) - np.array(obstacle.size) / 2).max())


@pytest.mark.parametrize("obstacle", OBSTACLES)
def test_drawn_points_are_on_the_surface_and_on_all_sides_of_it(obstacle: Obstacle) -> None:
    """Each of them at distance zero, and the middle of the obstacle among them."""
    points = surface(obstacle).reshape(-1, 3)
    assert max(abs(depth(obstacle, point)) for point in points) < 1e-9
    _, placement = obstacle.geometry()
    middle = (points.max(axis=0) + points.min(axis=0)) / 2
    assert middle == pytest.approx(placement.translation, abs=0.01)
