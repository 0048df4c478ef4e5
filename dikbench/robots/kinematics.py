"""Forward kinematics and body Jacobians of one robot, computed once per control step."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise
from typing import Any

import numpy as np
import pinocchio as pin

from dikbench.arrays import Array, Indices
from dikbench.robots.robot import Robot


class Kinematics:
    """The robot at one configuration: placements and Jacobians of its frames.

    Memory of its own takes as long to make as five updates; `robot.scratch` serves where nothing
    else uses it until the last result is read.

    Attributes:
        robot: the robot.
        q: the configuration of the last update, shape (nq,).
    """

    __slots__ = ("_data", "_model", "q", "robot")

    def __init__(self, robot: Robot, data: Any = None) -> None:
        self.robot = robot
        self._model = robot.model
        self._data = robot.model.createData() if data is None else data
        self.q: Array = robot.q0

    def update(self, q: Array) -> None:
        """Compute everything for configuration q (nq,)."""
        self.q = q
        pin.computeJointJacobians(self._model, self._data, q)

    def placement(self, frame: int) -> Any:
        """Compute the placement of a frame in the world, as a view: copy it to keep it."""
        return pin.updateFramePlacement(self._model, self._data, frame)

    def jacobian(self, frame: int) -> Array:
        """Compute the body Jacobian of a frame, (6, nv), rows (linear; angular) in its own axes."""
        J: Array = pin.getFrameJacobian(self._model, self._data, frame, pin.LOCAL)
        return J if J.ndim == 2 else J[:, None]  # Pinocchio returns a vector for a single joint

    def task_jacobian(self, rows: Sequence[int] | Indices | None = None) -> Array:
        """Compute rows of the task frame's Jacobian, (m, nv), in the robot's task axes.

        Args:
            rows: the rows (linear; angular); default: those that the robot is asked for.
        """
        robot = self.robot
        J = self.jacobian(robot.frame_id)
        if robot.task_axes == "world":
            R = self.placement(robot.frame_id).rotation
            J = np.vstack([R @ J[:3], R @ J[3:]])
        kept: Array = J[np.array(robot.task_rows if rows is None else rows)]
        return kept

    @property
    def spatial_jacobian(self) -> Array:
        """Twist (linear; angular) of each joint at the world's origin and in its axes, (6, n).

        The product of a wrench there and column k is the wrench's power on what joint k moves, per
        unit of the joint's speed; n = nv, or more where joints follow others (see
        `dikbench.robots.mimic.coupling`).
        """
        J: Array = self._data.J
        return J if J.ndim == 2 else J[:, None]

    def place_bodies(self, geometry: Any, placed: Any) -> None:
        """Place the bodies of a `pinocchio.GeometryModel` (in its data) at this configuration."""
        pin.updateGeometryPlacements(self._model, self._data, geometry, placed)

    def centre_of_mass(self) -> tuple[Array, Array]:
        """Compute the centre of mass (3,) [m] and its Jacobian (3, nv), in the world's axes.

        Both are not finite if the model has no mass.
        """
        J: Array = pin.jacobianCenterOfMass(self._model, self._data, self.q, False)
        centre: Array = self._data.com[0].copy()
        return centre, J


def smallest_singular_value(J: Array) -> float:
    """Compute the smallest of the min(m, n) singular values of a task Jacobian (m, n)."""
    return float(np.linalg.svd(J, compute_uv=False)[-1])


def placements(robot: Robot, frame: int, q: Array) -> Array:
    """Compute the placements of a frame at configurations (n, nq), (n, 4, 4)."""
    model, data = robot.model, robot.model.createData()
    # Views of what every update writes; to make a matrix of each takes as long as the kinematics.
    X = data.oMf[frame]
    R_T, p = X.rotation.T, X.translation
    rotations, translations = [], []
    for each in q:
        pin.forwardKinematics(model, data, each)
        pin.updateFramePlacement(model, data, frame)
        rotations.append(R_T.tobytes())
        translations.append(p.tobytes())
    found = np.zeros((len(q), 4, 4))
    found[:, :3, :3] = np.frombuffer(b"".join(rotations)).reshape(-1, 3, 3).transpose(0, 2, 1)
    found[:, :3, 3] = np.frombuffer(b"".join(translations)).reshape(-1, 3)
    found[:, 3, 3] = 1.0
    return found


def along(robot: Robot, q: Array, rows: Sequence[int] | None = None) -> tuple[Array, Array]:
    """Compute Jacobians and placements of the task frame at configurations (n, nq).

    Args:
        robot: the robot.
        q: the configurations.
        rows: see `Kinematics.task_jacobian`.

    Returns:
        Two arrays (n, m, nv) and (n, 4, 4).
    """
    frame, kinematics = robot.frame_id, Kinematics(robot, robot.scratch)
    bodies, frames = [], []
    for each in q:
        kinematics.update(each)
        frames.append(kinematics.placement(frame).homogeneous)
        bodies.append(kinematics.jacobian(frame))
    jacobians = np.array(bodies).reshape(-1, 6, robot.nv)
    placed = np.array(frames).reshape(-1, 4, 4)
    if robot.task_axes == "world":
        rotations = placed[:, None, :3, :3]
        jacobians = (rotations @ jacobians.reshape(-1, 2, 3, robot.nv)).reshape(jacobians.shape)
    return jacobians[:, list(robot.task_rows if rows is None else rows)], placed


def differences(robot: Robot, q: Array) -> Array:
    """Compute the displacements from each configuration of (n, nq) to the next, (n - 1, nv)."""
    if robot.nq == robot.nv:
        return np.diff(q, axis=0)
    between = [pin.difference(robot.model, here, there) for here, there in pairwise(q)]
    return np.array(between).reshape(-1, robot.nv)


def moved(robot: Robot, q: Array, steps: Array) -> Array:
    """Move configurations (n, nq) by displacements (n, nv)."""
    if robot.nq == robot.nv:
        return q + steps
    there = [pin.integrate(robot.model, *each) for each in zip(q, steps, strict=True)]
    return np.array(there).reshape(-1, robot.nq)
