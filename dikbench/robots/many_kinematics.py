"""Forward kinematics and body Jacobians of many robots of one model, vectorised over them."""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache
from typing import Any, Final

import numpy as np
import pinocchio as pin

from dikbench.arrays import Array
from dikbench.robots.kinematics import Kinematics
from dikbench.robots.robot import Robot

ENTRY_ROUNDING: Final = 1e-15
"""Entries of constant rotations this near to 0, 1 or -1 are these."""

_Terms = tuple[tuple[tuple[int, float], ...], ...]
"""The entries of a constant matrix that are not 0, column by column: (row, value)."""


@dataclass(frozen=True)
class _Joint:
    """A joint with one degree of freedom of the chain to the task frame.

    Its axis is the z axis of its frame, which `rotation` and `translation` place in the frame of
    the joint before it.
    """

    turns: bool
    circular: bool
    q: int
    v: int
    rotation: _Terms
    translation: Array


@dataclass(frozen=True)
class _Chain:
    """The joints from the root to the task frame, and the frame in the frame of the last one."""

    joints: tuple[_Joint, ...]
    rotation: _Terms
    translation: Array


class ManyKinematics:
    """The task frame's placements and Jacobians at N configurations.

    A row's numbers do not depend on the others, to the bit. A chain of joints with one degree of
    freedom each is computed for all rows at once, other models row by row by Pinocchio; both agree
    to rounding.

    Attributes:
        rotations: of the task frame in the world, (N, 3, 3).
        translations: its origin in the world, (N, 3) [m].
        jacobians: its body Jacobians, (N, 6, nv), rows (linear; angular) in its own axes.
    """

    __slots__ = ("_chain", "_kinematics", "_robot", "jacobians", "rotations", "translations")

    def __init__(self, robot: Robot) -> None:
        self._robot = robot
        self._chain = _chain_of(robot)
        self._kinematics = Kinematics(robot)
        self.rotations = np.empty((0, 3, 3))
        self.translations = np.empty((0, 3))
        self.jacobians = np.empty((0, 6, robot.nv))

    def update(self, q: Array) -> None:
        """Compute everything for configurations q, (N, nq)."""
        if self._chain is None:
            self._row_by_row(q)
        else:
            self._all_at_once(q, self._chain)

    def _row_by_row(self, q: Array) -> None:
        kinematics, frame = self._kinematics, self._robot.frame_id
        placements, jacobians = np.empty((len(q), 4, 4)), np.empty((len(q), 6, self._robot.nv))
        for k, row in enumerate(q):
            kinematics.update(row)
            placements[k] = kinematics.placement(frame).homogeneous
            jacobians[k] = kinematics.jacobian(frame)
        self.rotations, self.translations = placements[:, :3, :3], placements[:, :3, 3]
        self.jacobians = jacobians

    def _all_at_once(self, q: Array, chain: _Chain) -> None:
        count, number = len(q), len(chain.joints)
        # The rows are the last axis here, so that each operation runs through memory in order.
        columns, p = _columns_of_identity(count), np.zeros((3, count))
        axes, origins = np.empty((number, 3, count)), np.empty((number, 3, count))
        for k, joint in enumerate(chain.joints):
            columns, p = _placed(columns, p, joint.rotation, joint.translation)
            x, y, z = columns
            if joint.turns:
                if joint.circular:
                    cosine, sine = q[:, joint.q], q[:, joint.q + 1]
                else:
                    cosine, sine = np.cos(q[:, joint.q]), np.sin(q[:, joint.q])
                columns = [cosine * x + sine * y, cosine * y - sine * x, z]
            else:
                p = p + q[:, joint.q] * z
            axes[k], origins[k] = z, p
        (x, y, z), p = _placed(columns, p, chain.rotation, chain.translation)
        arms = p - origins
        jacobians = np.zeros((6, self._robot.nv, count))
        turning = [joint.turns for joint in chain.joints]
        linear = axes if not any(turning) else _cross(axes, arms)
        if not all(turning):
            linear[~np.array(turning)] = axes[~np.array(turning)]
        for row, side in enumerate((x, y, z)):
            along = _dot(side, linear)
            about = _dot(side, axes)
            for k, joint in enumerate(chain.joints):
                jacobians[row, joint.v] = along[k]
                if joint.turns:
                    jacobians[3 + row, joint.v] = about[k]
        self.rotations = np.stack([x, y, z], axis=1).transpose(2, 0, 1).copy()
        self.translations = p.T.copy()
        self.jacobians = jacobians.transpose(2, 0, 1).copy()


def _columns_of_identity(count: int) -> list[Array]:
    return [np.repeat(np.eye(3)[:, k : k + 1], count, axis=1) for k in range(3)]


def _placed(
    columns: list[Array], p: Array, rotation: _Terms, translation: Array
) -> tuple[list[Array], Array]:
    """Compose placements, columns (3, N) and origins (3, N), with a constant one."""
    for value, column in zip(translation.tolist(), columns, strict=True):
        if value:
            p = p + value * column
    return [_sum(columns, terms) for terms in rotation], p


def _sum(columns: list[Array], terms: tuple[tuple[int, float], ...]) -> Array:
    """Sum columns times values."""
    (first, value), *others = terms
    total = columns[first] if value == 1.0 else value * columns[first]
    for row, factor in others:
        total = total + factor * columns[row]
    return total


def _cross(a: Array, b: Array) -> Array:
    """Compute cross products of (n, 3, N)."""
    product = np.empty_like(a)
    for k in range(3):
        i, j = (k + 1) % 3, (k + 2) % 3
        product[:, k] = a[:, i] * b[:, j] - a[:, j] * b[:, i]
    return product


def _dot(side: Array, vectors: Array) -> Array:
    """Compute products of (3, N) with vectors (n, 3, N), (n, N)."""
    products: Array = side[0] * vectors[:, 0] + side[1] * vectors[:, 1] + side[2] * vectors[:, 2]
    return products


@lru_cache(maxsize=64)
def _chain_of(robot: Robot) -> _Chain | None:
    """Return the chain of a robot; None where a joint has more than one degree of freedom."""
    model, frame = robot.model, robot.model.frames[robot.frame_id]
    joints: list[_Joint] = []
    turned = np.eye(3)  # from the last joint's frame to the one whose z axis is its axis
    for index in list(model.supports[frame.parentJoint])[1:]:
        joint = model.joints[index]
        if joint.nv != 1 or joint.nq not in (1, 2) or "Mimic" in joint.shortname():
            return None
        data = joint.createData()
        joint.calc(data, pin.neutral(model))
        linear, angular = np.split(np.array(data.S).reshape(6), 2)
        turns = bool(angular.any())
        if turns and linear.any():
            return None
        placement = model.jointPlacements[index]
        to_axis = _with_z_along(angular if turns else linear)
        joints.append(
            _Joint(
                turns,
                joint.nq == 2,
                joint.idx_q,
                joint.idx_v,
                _terms(turned.T @ placement.rotation @ to_axis),
                turned.T @ placement.translation,
            )
        )
        turned = to_axis
    last = frame.placement
    return _Chain(
        tuple(joints), _terms(turned.T @ last.rotation), np.array(turned.T @ last.translation)
    )


def _with_z_along(axis: Array) -> Array:
    """Return a rotation (3, 3) whose third column is a unit vector."""
    first = np.eye(3)[int(np.abs(axis).argmin())]
    x = first - (first @ axis) * axis
    x /= np.linalg.norm(x)
    return np.column_stack([x, np.cross(axis, x), axis])


def _terms(rotation: Any) -> _Terms:
    """List the entries of a rotation that are not 0."""
    whole = np.round(rotation)
    exact = np.where(np.abs(rotation - whole) < ENTRY_ROUNDING, whole, rotation)
    return tuple(
        tuple((row, float(exact[row, k])) for row in range(3) if exact[row, k]) for k in range(3)
    )
