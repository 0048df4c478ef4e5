"""The surface of an obstacle as a grid of points, to be drawn."""

from __future__ import annotations

import numpy as np

from dikbench.arrays import Array
from dikbench.robots.collision.obstacles import BoxObstacle, Obstacle, SphereObstacle, capsule

MERIDIANS, PARALLELS = 17, 10


def surface(obstacle: Obstacle) -> Array:
    """Points of the surface, (k, l, 3) [m], from pole to pole and all the way round."""
    if isinstance(obstacle, BoxObstacle):
        ring = np.array([(1, 1), (-1, 1), (-1, -1), (1, -1), (1, 1)], dtype=float)
        rings = [(0.0, -1.0), (1.0, -1.0), (1.0, 1.0), (0.0, 1.0)]
        corners = np.array([np.column_stack([w * ring, np.full(5, z)]) for w, z in rings])
        turned = corners * np.array(obstacle.size) / 2 @ np.array(obstacle.rotation).T
        box: Array = turned + np.array(obstacle.centre)
        return box
    round_, down = np.meshgrid(
        np.linspace(0, 2 * np.pi, MERIDIANS), np.linspace(0, np.pi, 2 * PARALLELS)
    )
    ball = np.stack(
        [np.sin(down) * np.cos(round_), np.sin(down) * np.sin(round_), np.cos(down)], axis=-1
    )
    if isinstance(obstacle, SphereObstacle):
        return np.array(obstacle.centre) + obstacle.radius * ball
    start, end = np.array(obstacle.start), np.array(obstacle.end)
    _, placement = capsule(start, end, obstacle.radius)  # along z, from start to end
    ends = np.where(ball[..., 2:] > 0, end, start)
    points: Array = ends + obstacle.radius * ball @ placement.rotation.T
    return points
