"""Placements as points of a Euclidean space, in which the distance of two poses is one number."""

from __future__ import annotations

from dataclasses import dataclass
from math import sqrt
from typing import Any, Final

import numpy as np

from dikbench.arrays import Array
from dikbench.problem.progress import CHARACTERISTIC_LENGTH_M
from dikbench.problem.tasks import OrientationTask, PoseTask, PositionTask, TrackingTask
from dikbench.robots.robot import Robot

NEGLIGIBLE_WEIGHT_SHARE: Final = 1e-3
"""A row of a task whose weight is below this share of the largest is not asked for."""

SHORTEST: Final = 1e-12
"""At half a turn across its axis a turn about it is not defined; it is taken for none."""

FRAME_TASKS: Final = (PoseTask, PositionTask, OrientationTask)
"""The tasks that are about the placement of a frame."""


@dataclass(frozen=True, eq=False)
class Embedding:
    """Maps placements to points x so that |x(X) - x(Y)| is the distance d6 of what a task asks for.

        x(X) = [P p; s vec(A R B)],   d6(X, Y) = sqrt(|dp|^2 + (2 L sin(theta/2))^2)

    for a task on the whole pose, with P = A = B = I and s = L / sqrt 2. A task on the position has
    no second part, one on the orientation no first. Where a task leaves one axis a of the target
    free, the second part is L R a, and d6 has the angle between the two axes R a for theta. Where
    it asks for a turn about one axis only, A and B keep the plane across it, and of an arm that can
    turn otherwise too, x has L (cos psi, sin psi), psi being the turn about it that is left by the
    smallest rotation across it. A single linear row is
    one along an axis of the target at its start. Where the robot's task axes are the world's, a is
    a world axis, the second part L a^T R, and linear rows are along the world's axes.

    Attributes:
        linear: P, (r, 3).
        left: A, (k, 3).
        right: B, (3, l).
        scale: s [m]; 0 where nothing is asked of the orientation.
        of_one_turn: whether the second part is made of psi.
    """

    linear: Array
    left: Array
    right: Array
    scale: float
    of_one_turn: bool = False

    def points(self, rotations: Array, translations: Array) -> Array:
        """Map n placements to points, (n, d) [m].

        Args:
            rotations: (n, 3, 3).
            translations: (n, 3) [m].
        """
        parts = [translations @ self.linear.T]
        if self.scale:
            turned = self.left @ (rotations @ self.right)
            if self.of_one_turn:
                cosine = turned[:, 0, 0] + turned[:, 1, 1]
                sine = turned[:, 1, 0] - turned[:, 0, 1]
                length = np.maximum(np.hypot(cosine, sine), SHORTEST) / sqrt(2)
                turned = np.stack([cosine, sine], axis=1) / length[:, None]
            parts.append(self.scale * turned.reshape(len(turned), -1))
        points: Array = np.concatenate(parts, axis=1)
        return points


def embedding_of(
    task: TrackingTask, robot: Robot, start: Any, length: float = CHARACTERISTIC_LENGTH_M
) -> Embedding:
    """Make the embedding of what a task on a frame asks for.

    Rows are left out that the arm cannot move, and those of negligible weight.

    Args:
        task: the task.
        robot: the robot.
        start: rotation of the target at its start, (3, 3).
        length: L [m], the lever that turns angles into lengths.
    """
    rows = np.array(task.rows(robot))
    weights = np.broadcast_to(getattr(task, "weight", 1.0), rows.shape)
    kept = rows[weights >= NEGLIGIBLE_WEIGHT_SHARE * weights.max()]
    linear, angular = kept[kept < 3], kept[kept >= 3] - 3
    identity, axes = np.eye(3), np.asarray(start)
    world = robot.task_axes == "world"
    P = identity if len(linear) == 3 else (identity if world else axes.T)[linear]
    if len(angular) == 3:
        return Embedding(P, identity, identity, length / sqrt(2))
    free = np.setdiff1d(np.arange(3), angular)
    if len(angular) == 2 and world:
        return Embedding(P, identity[free], identity, length)
    if len(angular) == 2:
        return Embedding(P, identity, identity[:, free], length)
    turns = 2 in robot.movable_rows  # about other axes as well
    if len(angular) == 1 and world:
        return Embedding(P, identity[free], axes.T[:, free], length / sqrt(2), turns)
    if len(angular) == 1:
        return Embedding(P, axes.T[free], identity[:, free], length / sqrt(2), turns)
    return Embedding(P, identity, identity, 0.0)
