"""Forward kinematics and body Jacobians of one robot, computed once per control step."""

from __future__ import annotations

from typing import Any

import numpy as np
import pinocchio as pin

from dikbench.arrays import Array
from dikbench.robots.robot import Robot

LOCAL = pin.LOCAL  # looked up once: this is asked in every control step


class Kinematics:
    """The robot at one configuration: placements and Jacobians of its frames.

    Attributes:
        robot: the robot.
        q: the configuration of the last update, shape (nq,).
    """

    __slots__ = ("_data", "_model", "q", "robot")

    def __init__(self, robot: Robot) -> None:
        self.robot = robot
        self._model = robot.model
        self._data = robot.model.createData()
        self.q: Array = robot.q0

    def update(self, q: Array) -> None:
        """Compute everything for configuration q (nq,)."""
        self.q = q
        pin.computeJointJacobians(self._model, self._data, q)

    def placement(self, frame: int) -> Any:
        """Placement of a frame in the world, as a view into the data: copy it to keep it."""
        return pin.updateFramePlacement(self._model, self._data, frame)

    def jacobian(self, frame: int) -> Array:
        """Body Jacobian of a frame, (6, nv), rows (linear; angular) in the frame's own axes."""
        J: Array = pin.getFrameJacobian(self._model, self._data, frame, LOCAL)
        return J if J.ndim == 2 else J[:, None]  # of a single joint Pinocchio makes a vector

    @property
    def spatial_jacobian(self) -> Array:
        """The twist (linear; angular) that each joint gives, at the world's origin, (6, nv).

        In the world's axes. A wrench there times column k: its power on what joint k moves, per
        unit of the joint's speed.
        """
        J: Array = self._data.J
        return J if J.ndim == 2 else J[:, None]

    def place_bodies(self, geometry: Any, placed: Any) -> None:
        """Put the bodies of a `pinocchio.GeometryModel`, its data, where the robot has them."""
        pin.updateGeometryPlacements(self._model, self._data, geometry, placed)

    def centre_of_mass(self) -> tuple[Array, Array]:
        """Centre of mass (3,) [m] and its Jacobian (3, nv), in the axes of the world.

        Not finite if the model has no mass.
        """
        J: Array = pin.jacobianCenterOfMass(self._model, self._data, self.q, False)
        centre: Array = self._data.com[0].copy()
        return centre, J


def smallest_singular_value(J: Array) -> float:
    """The smallest of the min(m, n) singular values of a task Jacobian (m, n)."""
    return float(np.linalg.svd(J, compute_uv=False)[-1])


def placements(robot: Robot, frame: int, q: Array) -> Array:
    """Compute the placements of a frame at configurations (n, nq), (n, 4, 4)."""
    model, data = robot.model, robot.model.createData()
    found = []
    for each in q:
        pin.forwardKinematics(model, data, each)
        found.append(pin.updateFramePlacement(model, data, frame).homogeneous)
    return np.array(found)
