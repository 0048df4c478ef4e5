"""Obstacles in the world: spheres, capsules and boxes that do not move."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import coal
import numpy as np
import pinocchio as pin

from dikbench.arrays import Array
from dikbench.errors import DikbenchError
from dikbench.robots.robot import checked_vector

IDENTITY_ROTATION = ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0))


@dataclass(frozen=True)
class SphereObstacle:
    """A ball in the world.

    Attributes:
        centre: (3,) [m].
        radius: [m].
    """

    centre: tuple[float, float, float]
    radius: float

    def __post_init__(self) -> None:
        """Check the parameters."""
        _keep_point(self, "centre")
        _check_length("SphereObstacle: radius", self.radius)

    def geometry(self) -> tuple[Any, Any]:
        """Return its shape (coal) and its placement in the world (`pinocchio.SE3`)."""
        return coal.Sphere(self.radius), pin.SE3(np.eye(3), np.array(self.centre))


@dataclass(frozen=True)
class CapsuleObstacle:
    """All points of the world within a radius of a segment: a pole, a cable, a rail.

    Attributes:
        start, end: of the segment, (3,) [m].
        radius: [m].
    """

    start: tuple[float, float, float]
    end: tuple[float, float, float]
    radius: float

    def __post_init__(self) -> None:
        """Check the parameters."""
        _keep_point(self, "start")
        _keep_point(self, "end")
        _check_length("CapsuleObstacle: radius", self.radius)
        if self.start == self.end:
            raise DikbenchError("CapsuleObstacle: start and end are one point; use SphereObstacle")

    def geometry(self) -> tuple[Any, Any]:
        """Return its shape (coal) and its placement in the world (`pinocchio.SE3`)."""
        return capsule(np.array(self.start), np.array(self.end), self.radius)


@dataclass(frozen=True)
class BoxObstacle:
    """A box in the world: a table, a wall.

    Attributes:
        centre: (3,) [m].
        size: lengths of its edges, (3,) [m].
        rotation: its axes in those of the world, as columns, (3, 3).
    """

    centre: tuple[float, float, float]
    size: tuple[float, float, float]
    rotation: tuple[tuple[float, float, float], ...] = IDENTITY_ROTATION

    def __post_init__(self) -> None:
        """Check the parameters."""
        _keep_point(self, "centre")
        _keep_point(self, "size")
        for length in self.size:
            _check_length("BoxObstacle: size", length)
        R = np.array(self.rotation, dtype=float)
        if R.shape != (3, 3) or not np.allclose(R.T @ R, np.eye(3), atol=1e-6):
            raise DikbenchError("BoxObstacle: rotation: expected a rotation matrix (3, 3)")
        object.__setattr__(self, "rotation", tuple(map(tuple, R.tolist())))

    def geometry(self) -> tuple[Any, Any]:
        """Return its shape (coal) and its placement in the world (`pinocchio.SE3`)."""
        return coal.Box(*self.size), pin.SE3(np.array(self.rotation), np.array(self.centre))


Obstacle = SphereObstacle | CapsuleObstacle | BoxObstacle


def capsule(start: Array, end: Array, radius: float) -> tuple[Any, Any]:
    """Build a capsule (coal, along its own z) about a segment (3,), (3,) [m], and its placement.

    It is a sphere where the segment is a point.
    """
    axis = end - start
    length = float(np.linalg.norm(axis))
    middle = (start + end) / 2
    if length == 0:
        return coal.Sphere(radius), pin.SE3(np.eye(3), middle)
    z = np.array([0.0, 0.0, 1.0])
    turn = pin.Quaternion.FromTwoVectors(z, axis / length).toRotationMatrix()
    return coal.Capsule(radius, length), pin.SE3(turn, middle)


def _keep_point(obstacle: Any, name: str) -> None:
    """Replace a point by a tuple of floats."""
    what = f"{type(obstacle).__name__}: {name}"
    point = checked_vector(getattr(obstacle, name), 3, what)
    object.__setattr__(obstacle, name, tuple(point.tolist()))


def _check_length(what: str, length: float) -> None:
    if not 0 < length < float("inf"):
        raise DikbenchError(f"{what}={length} must be positive and finite")
