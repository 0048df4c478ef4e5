"""Pairs of bodies and obstacles: their distances at a configuration, and how the joints move them.

    phi(q + dq) = phi + g . dq + O(|dq|^2),   g = dphi/dq = n^T (J_b - J_a)

for a pair (a, b) with signed distance phi [m] (negative: how deep they are in each other), n the
unit vector from a to b at the nearest points and J_a, J_b the Jacobians of these points of the two
bodies, in the axes of the world. An obstacle does not move: J_b = 0.
"""

from __future__ import annotations

import warnings
from collections.abc import Sequence
from itertools import combinations
from typing import Any

import coal
import numpy as np
import pinocchio as pin

from dikbench.arrays import Array, Indices
from dikbench.robots.collision.bodies import collision_bodies
from dikbench.robots.collision.obstacles import Obstacle
from dikbench.robots.kinematics import Kinematics
from dikbench.robots.mimic import coupling
from dikbench.robots.robot import Robot

DISTANCE_TOLERANCE_M = 1e-10
"""Tolerance of iterative distances (cylinders, boxes), whose nearest points are off by its square
root; coal's own 1e-6 leaves errors of 5e-3 m/rad in the gradients."""

DEPTH_TOLERANCE_M = 1e-6
"""Tolerance of depths of cylinders and cones in other bodies. With a finer one coal 3.0 finds none,
or a wrong one, for one in ten cylinders in each other."""

NEXT_AXES, PREVIOUS_AXES = [1, 2, 0], [2, 0, 1]
"""The axes that follow and precede x, y, z in a cross product."""


class CollisionPairs:
    """The pairs of bodies and obstacles of a robot that must not touch.

    Bodies that move relative to each other are a pair, except those of adjacent joints, those that
    the robot's SRDF excludes, and those nearer than `margin` [m] at the robot's safe start, where
    the bodies are too coarse. Every moving body and every obstacle are a pair.

    Attributes:
        names: the names of the two, per pair.
        joints: the joints that carry them, per pair; 0 for the world.
        left_out: names of the pairs left out because they are near at the safe start.
    """

    def __init__(
        self, robot: Robot, obstacles: Sequence[Obstacle], margin: float, *, self_collision: bool
    ) -> None:
        self._robot = robot
        self._geometry = collision_bodies(robot)
        self.left_out: tuple[tuple[str, str], ...] = ()
        bodies = list(self._geometry.geometryObjects)
        if self_collision:
            self._pair_bodies(bodies, margin)
        for number, obstacle in enumerate(obstacles):
            shape, placement = obstacle.geometry()
            added = self._geometry.addGeometryObject(
                pin.GeometryObject(f"obstacle_{number}", 0, placement, shape)
            )
            for index, body in enumerate(bodies):
                if body.parentJoint != 0:
                    self._geometry.addCollisionPair(pin.CollisionPair(index, added))
        self.names = tuple(self._names(pair) for pair in self._geometry.collisionPairs)
        objects = self._geometry.geometryObjects
        self.joints: tuple[tuple[int, int], ...] = tuple(
            (objects[pair.first].parentJoint, objects[pair.second].parentJoint)
            for pair in self._geometry.collisionPairs
        )
        moved = _moved(robot.model)
        self._signs = np.array([moved[b] - moved[a] for a, b in self.joints])
        self._coupling = coupling(robot.model)
        self._place()

    def __len__(self) -> int:
        """Return the number of pairs."""
        return len(self.names)

    def distances(self, kinematics: Kinematics) -> Array:
        """Compute the signed distances at a configuration, (p,) [m]."""
        kinematics.place_bodies(self._geometry, self._placed)
        pin.computeDistances(self._geometry, self._placed)
        return np.array([result.min_distance for result in self._results])

    def nearest(self) -> tuple[float, Array]:
        """Return the smallest distance [m] at the last `distances`, and the two points, (2, 3)."""
        result = min(self._results, key=lambda found: float(found.min_distance))
        points = np.array([result.getNearestPoint1(), result.getNearestPoint2()])
        return float(result.min_distance), points

    def gradients(self, kinematics: Kinematics, pairs: Indices) -> Array:
        """Compute dphi/dq of some pairs, (k, nv) [m/rad or 1], at the last `distances`.

        Zero where the nearest points have no direction from each other (axes that cross).
        """
        results = [self._results[pair] for pair in pairs.tolist()]
        # A unit force along n through both nearest points.
        wrenches = np.empty((len(results), 6))
        n = wrenches[:, :3] = np.array([result.normal for result in results]).reshape(-1, 3)
        points = np.array([result.getNearestPoint1() for result in results]).reshape(-1, 3)
        wrenches[:, 3:] = (
            points[:, NEXT_AXES] * n[:, PREVIOUS_AXES] - points[:, PREVIOUS_AXES] * n[:, NEXT_AXES]
        )
        gradients: Array = (wrenches @ kinematics.spatial_jacobian) * self._signs[pairs]
        return gradients if self._coupling is None else gradients @ self._coupling

    def _pair_bodies(self, bodies: list[Any], margin: float) -> None:
        model, geometry = self._robot.model, self._geometry
        for (i, a), (j, b) in combinations(enumerate(bodies), 2):
            joints = a.parentJoint, b.parentJoint
            if joints[0] != joints[1] and not _adjacent(model, *joints):
                geometry.addCollisionPair(pin.CollisionPair(i, j))
        if self._robot.srdf:
            pin.removeCollisionPairs(model, geometry, self._robot.srdf)
        self._place()
        kinematics = Kinematics(self._robot)
        kinematics.update(self._robot.q0)
        near = np.flatnonzero(self.distances(kinematics) < margin)
        left_out = [pin.CollisionPair(p.first, p.second) for p in geometry.collisionPairs]
        left_out = [left_out[index] for index in near]
        self.left_out = tuple(self._names(pair) for pair in left_out)
        for pair in left_out:
            geometry.removeCollisionPair(pair)

    def _place(self) -> None:
        self._placed = self._geometry.createData()
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", DeprecationWarning)
            for request, pair in zip(
                self._placed.distanceRequests, self._geometry.collisionPairs, strict=True
            ):
                request.gjk_tolerance = request.epa_tolerance = DISTANCE_TOLERANCE_M
                shapes = [
                    self._geometry.geometryObjects[n].geometry for n in (pair.first, pair.second)
                ]
                if any(isinstance(shape, (coal.Cylinder, coal.Cone)) for shape in shapes):
                    request.epa_tolerance = DEPTH_TOLERANCE_M
                # A guess from the previous call would change the last bits. The name is deprecated,
                # but the new one does not switch the guess off (coal 3.0).
                request.enable_cached_gjk_guess = False
        self._results = list(self._placed.distanceResults)

    def _names(self, pair: Any) -> tuple[str, str]:
        objects = self._geometry.geometryObjects
        return objects[pair.first].name, objects[pair.second].name


def _adjacent(model: Any, first: int, second: int) -> bool:
    return first in (second, model.parents[second]) or second == model.parents[first]


def _moved(model: Any) -> Array:
    """Mark the joints' velocities that move the bodies of each joint: 1 or 0, (njoints, n)."""
    moved = np.zeros((model.njoints, model.nvExtended))
    for joint in range(1, model.njoints):
        for support in model.supports[joint]:
            carrier = model.joints[support]
            if support:
                first = carrier.idx_vExtended
                moved[joint, first : first + carrier.nvExtended] = 1.0
    return moved
