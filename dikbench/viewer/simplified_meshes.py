"""The links of a robot as few triangles: convex hulls of the parts of its geometry."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from functools import lru_cache
from typing import Any, Final, NamedTuple

import coal
import numpy as np
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components
from scipy.spatial import ConvexHull

from dikbench.arrays import Array, Indices
from dikbench.robots.robot import Robot
from dikbench.viewer.capsules import capsules

CORNERS: Final = 1100
"""Corners of all hulls of a robot; a hull has about twice as many triangles."""

FEWEST_CORNERS, MOST_CORNERS = 28, 140
"""Corners of one hull, before those that are not needed are dropped."""

SMALLEST_PART_SHARE: Final = 0.2
"""Parts of a mesh that are smaller are left out, as a share of its size: screws, caps."""

BEYOND_SHARE: Final = 0.01
"""But not where they reach farther than larger ones, by this share of its size."""

MOST_PARTS: Final = 6
"""A mesh of more parts is taken as one: its triangles do not meet."""

SEAM_M: Final = 1e-5
"""Vertices nearer than this are one."""

GRID_M: Final = 2.0**-12
"""Vertices are rounded to multiples of this, which compresses well."""

RING_POINTS: Final = 20
"""Points on a circle of a cylinder, a cone or a capsule."""


FEWEST_FOR_A_HULL: Final = 4


class Mesh(NamedTuple):
    """Triangles in the frame of a joint.

    Attributes:
        vertices: (k, 3) [m].
        faces: indices of the vertices of each triangle, counter-clockwise from outside, (m, 3).
    """

    vertices: Array
    faces: Indices


NO_MESH: Final = Mesh(np.empty((0, 3)), np.empty((0, 3), dtype=np.intp))


def simplified_meshes(robot: Robot) -> Mapping[int, Mesh]:
    """Simplify the visual geometry of a robot, else its capsules: a mesh per joint with any.

    Each connected part of a mesh becomes the convex hull of its extreme points, so that holes and
    hollows are filled, and what has many triangles has about 2000 in all.

    Returns:
        The meshes by Pinocchio's index of the joint, 0 for the base.
    """
    found = None if robot.visuals is None else _of_visuals(robot.visuals)
    return _simplified(capsules(robot)) if found is None else found


@lru_cache(maxsize=16)
def _of_visuals(visuals: Callable[[], Any]) -> Mapping[int, Mesh] | None:
    """Simplify the geometry of all robots that have it; None for a URDF without its meshes."""
    try:
        geometry = visuals()
    except ValueError:
        return None
    return _simplified(geometry)


def _simplified(geometry: Any) -> Mapping[int, Mesh]:
    clouds = [
        (body.parentJoint, part @ body.placement.rotation.T + body.placement.translation)
        for body in geometry.geometryObjects
        for part in _parts(body.geometry)
    ]
    total = sum(_size(cloud) for _, cloud in clouds)
    found: dict[int, Mesh] = {}
    for joint, cloud in clouds:
        corners = round(CORNERS * _size(cloud) / total)
        added = hull(cloud, min(max(corners, FEWEST_CORNERS), MOST_CORNERS))
        before = found.get(joint, NO_MESH)
        found[joint] = Mesh(
            np.vstack([before.vertices, added.vertices]),
            np.vstack([before.faces, added.faces + len(before.vertices)]),
        )
    return found


def hull(points: Array, corners: int) -> Mesh:
    """Compute the convex hull of the points that are farthest in some directions.

    Args:
        points: (n, 3) [m].
        corners: number of directions, and the largest number of vertices.

    Returns:
        The hull, empty where fewer than four points are left.
    """
    farthest = np.unique((points @ _directions(corners).T).argmax(axis=0))
    kept = np.unique(np.round(points[farthest] / GRID_M), axis=0) * GRID_M
    if len(kept) < FEWEST_FOR_A_HULL:
        return NO_MESH
    found = ConvexHull(kept, qhull_options="QJ Pp")  # joggled: the points may lie in a plane
    used, faces = np.unique(found.simplices, return_inverse=True)
    faces = faces.reshape(-1, 3)
    vertices = kept[used]
    a, b, c = np.moveaxis(vertices[faces], 1, 0)
    inward = np.einsum("ij,ij->i", np.cross(b - a, c - a), found.equations[:, :3]) < 0
    faces[inward] = faces[inward][:, ::-1]
    return Mesh(vertices, faces)


def _parts(shape: Any) -> list[Array]:
    """Return the vertices of the parts of a shape of coal that are to become hulls, (k, 3) each."""
    if not hasattr(shape, "vertices"):
        return [_primitive(shape)]
    vertices = np.asarray(shape.vertices()).reshape(-1, 3)
    if not hasattr(shape, "num_tris"):
        return [vertices]
    found = map(shape.tri_indices, range(shape.num_tris))
    triangles = np.array([[triangle[k] for k in range(3)] for triangle in found])
    used, triangles = np.unique(triangles, return_inverse=True)
    vertices, triangles = vertices[used], triangles.reshape(-1, 3)  # some files have stray points
    seams, merged = np.unique(np.round(vertices / SEAM_M), axis=0, return_inverse=True)
    a, b, c = merged.ravel()[triangles].T
    edges = np.concatenate([a, b]), np.concatenate([b, c])
    graph = coo_array((np.ones(len(edges[0])), edges), shape=(len(seams), len(seams)))
    count, of = connected_components(graph, directed=False)
    parts = [vertices[of[merged.ravel()] == number] for number in range(count)]
    kept = _telling(sorted(parts, key=_size, reverse=True), _size(vertices))
    return kept if len(kept) <= MOST_PARTS else [vertices]


def _telling(parts: list[Array], size: float) -> list[Array]:
    """Choose the parts (k, 3) of a mesh that are large, or reach beyond larger ones."""
    kept, low, high = list[Array](), np.full(3, np.inf), np.full(3, -np.inf)
    for part in parts:
        ends = part.min(axis=0), part.max(axis=0)
        beyond = max((low - ends[0]).max(), (ends[1] - high).max())
        if _size(part) >= SMALLEST_PART_SHARE * size or beyond > BEYOND_SHARE * size:
            kept.append(part)
            low, high = np.minimum(low, ends[0]), np.maximum(high, ends[1])
    return kept


def _primitive(shape: Any) -> Array:
    """Return points (k, 3) of the surface of a primitive shape of coal, in its own frame."""
    angle = np.linspace(0.0, 2 * np.pi, RING_POINTS, endpoint=False)
    ring = np.column_stack([np.cos(angle), np.sin(angle), np.zeros(RING_POINTS)])
    ball, up = _directions(MOST_CORNERS), np.array([0.0, 0.0, 1.0])
    if isinstance(shape, coal.Box):
        points = np.array(np.meshgrid(*([-1, 1],) * 3)).reshape(3, -1).T * shape.halfSide
    elif isinstance(shape, coal.Sphere):
        points = shape.radius * ball
    elif isinstance(shape, coal.Capsule):
        points = shape.radius * ball + np.where(ball[:, 2:] > 0, 1, -1) * shape.halfLength * up
    else:
        top = 0.0 if isinstance(shape, coal.Cone) else shape.radius
        middles = shape.halfLength * up
        points = np.vstack([shape.radius * ring - middles, top * ring + middles])
    return np.asarray(points, dtype=float)


def _directions(count: int) -> Array:
    """Spread unit vectors evenly over the sphere, on a spiral, (count, 3)."""
    number = np.arange(count) + 0.5
    z = 1 - 2 * number / count
    angle = np.pi * (1 + np.sqrt(5)) * number
    flat = np.sqrt(1 - z**2)
    return np.column_stack([flat * np.cos(angle), flat * np.sin(angle), z])


def _size(points: Array) -> float:
    return float(np.linalg.norm(np.ptp(points, axis=0)))
