"""A task and its linearisation at one configuration."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, Final, Protocol

import msgspec
import numpy as np
import pinocchio as pin
import scipy.linalg

from dikbench.arrays import Array
from dikbench.errors import DikbenchError
from dikbench.linear_algebra import product, scaled_identity, times, transposed
from dikbench.robots.kinematics import Kinematics
from dikbench.robots.robot import Robot, frame_id

ROTATION_ROUNDING: Final = 1e-6
"""Largest error of a rotation's entries, about that of single precision: the angle of the logarithm
is off by its root."""


class LinearizedTask(msgspec.Struct, eq=False):
    """A task at one configuration, J v = V, with the desired velocity V.

    Attributes:
        J: task Jacobian, (m, nv).
        V: desired task velocity, (m,) [m/s; rad/s]: gain times error plus feed-forward.
        error: task error, (m,) [m; rad], zero when the task is done.
        weight: multiplies the squared norm ||J v - V||^2 where tasks compete: one number, or one
            per row (m,).
        priority: 1 is the most important.
    """

    J: Array
    V: Array
    error: Array
    weight: float | Array = 1.0
    priority: int = 1

    @property
    def log_derivative(self) -> Array | None:
        """The (m, m) matrix Jl of d(error)/dt = -Jl J v; None where it is the identity.

        Multiplying both sides of J v = V by it (Jl e = e) has no effect on one full-rank task
        without active bounds, but does under damping, competing weights and rank loss.
        """
        return None

    def normal_equations(self, *, log_derivative: bool = False) -> tuple[Array, Array]:
        """Compute J^T W J, (nv, nv), and J^T W V, (nv,), the task's part of a least-squares cost.

        Args:
            log_derivative: whether to multiply J and V by that matrix first.
        """
        J, V = self.J, self.V
        Jl = self.log_derivative if log_derivative else None
        if Jl is not None:
            J, V = Jl @ J, Jl @ V
        weighted = transposed(J) * self.weight
        return product(weighted, J), times(weighted, V)


class LinearizedJointTask(LinearizedTask, eq=False):
    """A task on the joint velocities: J is the identity, read-only; weights are one or (nv,)."""

    def normal_equations(self, *, log_derivative: bool = False) -> tuple[Array, Array]:
        """Compute W and W V (see `LinearizedTask`)."""
        weight = self.weight
        if type(weight) is float:  # the same matrix at every step
            return scaled_identity(len(self.J), weight), self.V * weight
        return self.J * weight, self.V * weight


def check_weight(task: str, weight: float | Array, rows: int) -> None:
    """Check the weight of a task with a number of rows; `task` names it in the message.

    Raises:
        DikbenchError: if it is not one finite number, at least 0, or one such number per row.
    """
    if type(weight) is float and 0 <= weight < np.inf:
        return
    try:
        values = np.asarray(weight, dtype=float)
        given = values.tolist()
    except (TypeError, ValueError):
        values, given = np.array(np.nan), repr(weight)
    if values.shape not in {(), (rows,)} or not np.all((values >= 0) & (values < np.inf)):
        raise DikbenchError(
            f"{task}: weight: expected a number or {rows} numbers, finite and at least 0, "
            f"got {given}"
        )


class Task(Protocol):
    """What is desired: a frozen dataclass with at least these members."""

    @property
    def priority(self) -> int:
        """1 is the most important."""
        ...

    def linearize(self, kinematics: Kinematics) -> LinearizedTask:
        """Return the task at the configuration of `kinematics`."""
        ...


class TrackingTask(Task, Protocol):
    """A task whose target moves and is given to `linearize` at every step."""

    @property
    def gain(self) -> float:
        """1/s."""
        ...

    def rows(self, robot: Robot) -> tuple[int, ...]:
        """Return the rows of the task frame's twist (linear; angular) that it is about."""
        ...

    def linearize(
        self, kinematics: Kinematics, target: Any = None, velocity: Any = None
    ) -> LinearizedTask:
        """Linearise the task for a target and its body twist (see `FrameTask`)."""
        ...


@dataclass(frozen=True, eq=False)
class FrameTask(ABC):
    """A task on a frame of the robot, in the axes of the frame.

    Attributes:
        target: where the frame is to be; None: given to `linearize` at every step.
        gain: 1/s.
        weight: see `LinearizedTask`.
        priority: see `LinearizedTask`.
        frame: name of the frame; None: the robot's task frame.
    """

    target: Any = None
    gain: float = 1.0
    weight: float | Array = 1.0
    priority: int = 1
    frame: str | None = None

    @abstractmethod
    def rows(self, robot: Robot) -> tuple[int, ...]:
        """Return the rows of the twist (linear; angular) that the task is about."""

    @abstractmethod
    def linearize(
        self, kinematics: Kinematics, target: Any = None, velocity: Any = None
    ) -> LinearizedTask:
        """Linearise the task at the configuration of `kinematics`.

        Args:
            kinematics: the robot at its configuration.
            target: this step's target; default: the task's own.
            velocity: the target's body twist V_d (`pinocchio.Motion`); None: at rest.

        Raises:
            DikbenchError: if the target, the weights or the frame do not fit.
        """

    def frame_id(self, robot: Robot) -> int:
        """Return Pinocchio's index of the frame.

        Raises:
            DikbenchError: if the robot has no frame of this name.
        """
        return robot.frame_id if self.frame is None else frame_id(robot.model, self.frame)


def check_rotation(task: str, rotation: Array) -> None:
    """Check that the rotation (3, 3) of a target is one; `task` names it in the message.

    Its rows a, b, c must be of length 1, a and b perpendicular, and c = a x b. In Python's numbers,
    since each step checks its target: a sixth of numpy's time.

    Raises:
        DikbenchError: if it is scaled, sheared, mirrored or not finite.
    """
    (a, b, c), (d, e, f), (g, h, i) = rotation.tolist()
    if (
        abs(a * a + b * b + c * c - 1) + abs(d * d + e * e + f * f - 1) + abs(a * d + b * e + c * f)
        + abs(b * f - c * e - g) + abs(c * d - a * f - h) + abs(a * e - b * d - i)
        < ROTATION_ROUNDING
    ):  # fmt: skip
        return
    raise DikbenchError(
        f"{task}: target: {np.round(rotation, 6).tolist()} is not a rotation: R^T R must be the "
        "identity and det R = 1"
    )


def part_of_target(target: Any, part: str, shape: tuple[int, ...], expected: str) -> Array:
    """Return the rotation or translation of a target, an SE3 or an array of this part's shape.

    Raises:
        DikbenchError: if it is neither; `expected` names the task and the array.
    """
    found: Array = getattr(target, part) if isinstance(target, pin.SE3) else target
    if not isinstance(found, np.ndarray) or found.shape != shape:
        got = getattr(found, "shape", type(found).__name__)
        raise DikbenchError(f"{expected} or a pinocchio.SE3, got {got}")
    return found


def stacked(tasks: list[LinearizedTask]) -> LinearizedTask:
    """Stack several tasks of one priority, rows below each other."""
    if len(tasks) == 1:
        return tasks[0]
    return _StackedTask(
        np.vstack([t.J for t in tasks]),
        np.concatenate([t.V for t in tasks]),
        np.concatenate([t.error for t in tasks]),
        np.concatenate([np.broadcast_to(t.weight, t.V.shape) for t in tasks]),
        tasks[0].priority,
        tasks,
    )


class _StackedTask(LinearizedTask, eq=False):
    parts: Sequence[LinearizedTask] = ()

    @property
    def log_derivative(self) -> Array | None:
        blocks = [part.log_derivative for part in self.parts]
        if all(block is None for block in blocks):
            return None
        filled = [
            np.eye(len(part.V)) if block is None else block
            for part, block in zip(self.parts, blocks, strict=True)
        ]
        matrix: Array = scipy.linalg.block_diag(*filled)
        return matrix
