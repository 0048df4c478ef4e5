"""A path as a tube of triangles, through which what lies on the path is seen."""

from __future__ import annotations

from typing import Final

import numpy as np

from dikbench.arrays import Array
from dikbench.viewer.simplified_meshes import Mesh

RING: Final = 8
"""Corners around the tube."""

STANDING_STILL_M: Final = 1e-6
"""Points of a path nearer to each other than this are one."""


ALONG_THE_TANGENT: Final = 1e-3
"""Length of what is left of a normal across the tangent, below which another is taken."""


def tube(points: Array, radius: float) -> Mesh | None:
    """Build a tube about a path; None where it does not move.

    Args:
        points: of the path, (n, 3) [m].
        radius: [m].
    """
    moved = np.linalg.norm(np.diff(points, axis=0), axis=1) > STANDING_STILL_M
    points = points[np.concatenate([[True], moved])]
    if len(points) < 2:
        return None
    before = np.diff(points, axis=0, prepend=2 * points[:1] - points[1:2])
    tangents = np.gradient(points, axis=0)
    turning_back = np.linalg.norm(tangents, axis=1) < STANDING_STILL_M
    tangents[turning_back] = before[turning_back]
    tangents /= np.linalg.norm(tangents, axis=1, keepdims=True)
    angle = np.linspace(0.0, 2 * np.pi, RING, endpoint=False)[:, None]
    normal = np.eye(3)[np.abs(tangents[0]).argmin()]
    rings = []
    for at, tangent in zip(points, tangents, strict=True):
        # The normal of the ring before, as little turned as possible.
        normal = normal - (normal @ tangent) * tangent
        if np.linalg.norm(normal) < ALONG_THE_TANGENT:
            least = np.eye(3)[np.abs(tangent).argmin()]
            normal = least - (least @ tangent) * tangent
        normal = normal / np.linalg.norm(normal)
        beside = np.cross(tangent, normal)
        rings.append(at + radius * (np.cos(angle) * normal + np.sin(angle) * beside))
    first = np.arange(RING * (len(points) - 1))
    after = first - first % RING + (first + 1) % RING  # the next corner of the same ring
    faces = np.vstack(
        [
            np.column_stack([first, after, first + RING]),
            np.column_stack([after, after + RING, first + RING]),
        ]
    )
    return Mesh(np.vstack(rings), faces)
