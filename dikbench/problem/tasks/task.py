"""A task and its linearisation at one configuration."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, Protocol

import msgspec
import numpy as np
import scipy.linalg

from dikbench.arrays import Array
from dikbench.errors import DikbenchError
from dikbench.linear_algebra import scaled_identity
from dikbench.robots.kinematics import Kinematics
from dikbench.robots.robot import Robot


class LinearizedTask(msgspec.Struct, eq=False):
    """A task at one configuration: J v = V.

    Attributes:
        J: task Jacobian, (m, nv).
        V: wanted task velocity, (m,) [m/s; rad/s]: gain times error plus feed-forward.
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

        Multiplying both sides of J v = V by it changes nothing for one full-rank task without
        active bounds (Jl e = e), and something under damping, competing weights, rank loss.
        """
        return None

    def normal_equations(self, *, log_derivative: bool = False) -> tuple[Array, Array]:
        """J^T W J, (nv, nv), and J^T W V, (nv,): the task's share of a least-squares cost.

        To be read, not written to: some tasks have the same matrix in every step.

        Args:
            log_derivative: whether to multiply J and V by the matrix of that name first.
        """
        J, V = self.J, self.V
        Jl = self.log_derivative if log_derivative else None
        if Jl is not None:
            J, V = Jl @ J, Jl @ V
        weighted = J.T if type(self.weight) is float and self.weight == 1.0 else J.T * self.weight
        return weighted.dot(J), weighted.dot(V)


class LinearizedJointTask(LinearizedTask, eq=False):
    """A task on the joint velocities themselves: J is the identity (shared: not to be written to).

    The weights are one number or one per joint, (nv,).
    """

    def normal_equations(self, *, log_derivative: bool = False) -> tuple[Array, Array]:
        """W and W V (see `LinearizedTask`): nothing to multiply."""
        if type(self.weight) is float:
            return scaled_identity(len(self.V), self.weight), self.V * self.weight
        return self.J * self.weight, self.V * self.weight


def check_weight(task: str, weight: float | Array, rows: int) -> None:
    """Check the weight of a task with so many rows, named for the message.

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
    """What is wanted: a frozen dataclass with at least these fields."""

    @property
    def priority(self) -> int:
        """1 is the most important."""
        ...

    def linearize(self, kinematics: Kinematics) -> LinearizedTask:
        """Return the task at the configuration of `kinematics`."""
        ...


class TrackingTask(Task, Protocol):
    """A task whose target moves: it is handed to `linearize` at every step."""

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
        """The task at the configuration of `kinematics`, its target and the target's body twist."""
        ...


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
