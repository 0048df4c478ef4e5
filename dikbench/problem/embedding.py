"""Placements as points of a Euclidean space, in which the distance of two poses is one number."""

from __future__ import annotations

from dataclasses import dataclass
from math import sqrt
from typing import Any, Final

import numpy as np

from dikbench.arrays import Array
from dikbench.problem.progress import CHARACTERISTIC_LENGTH_M
from dikbench.problem.tasks import OrientationTask, PoseTask, PositionTask, TrackingTask
from dikbench.problem.tasks.rows import orientation_error
from dikbench.robots.robot import Robot

NEGLIGIBLE_WEIGHT_SHARE: Final = 1e-3
"""A row of a task whose weight is below this share of the largest is not asked for."""

SHORTEST: Final = 1e-12
"""At half a turn across its axis a turn about it is not defined; it is taken for none."""

FRAME_TASKS: Final = (PoseTask, PositionTask, OrientationTask)
"""The tasks that are about the placement of a frame."""

Placements = tuple[Array, Array]
"""Rotations (n, 3, 3) and translations (n, 3) [m]."""


@dataclass(frozen=True, eq=False)
class Embedding:
    """Maps placements to points x so that |x(X) - x(Y)| is the distance d6 of what a task asks for.

        x(X) = [P p; s vec(A R B)],   d6(X, Y) = sqrt(|dp|^2 + (2 L sin(theta/2))^2)

    for a task on the whole pose, with P = A = B = I and s = L / sqrt 2. A task on the position has
    no second part, one on the orientation no first. Where a task leaves one axis a of the target
    free, the second part is L R a, and d6 has the angle between the two axes R a for theta. Where
    it asks for a turn about one axis only, A and B keep the plane across it, and of an arm that can
    turn otherwise too, x has L (cos psi, sin psi), psi being the turn about it that is left by the
    smallest rotation across it. One or two linear rows are along axes of the target at its start.
    Where the robot's task axes are the world's, a is a world axis, the second part L a^T R, and
    linear rows are along the world's axes.

    No points have the distances of two kinds of rows: linear ones in axes of a frame that turns
    out of their span (then P = I), and a turn about one axis where the arm can tilt. There points
    are of targets only, and `beside` places the frame beside its target by the task's own error.

    Attributes:
        linear: P, (r, 3).
        left: A, (k, 3).
        right: B, (3, l).
        scale: s [m]; 0 where nothing is asked of the orientation.
        of_one_turn: whether the second part is made of psi.
        turning: the linear rows whose axes turn with the frame; none where points do.
        turn: the axis of the one turn that is asked for where the arm can tilt; else None.
        robot: whose task axes count for that turn.
    """

    linear: Array
    left: Array
    right: Array
    scale: float
    of_one_turn: bool = False
    turning: tuple[int, ...] = ()
    turn: int | None = None
    robot: Robot | None = None

    @property
    def by_error(self) -> bool:
        """Whether points are of targets only, and frames are placed beside them by `beside`."""
        return bool(self.turning) or self.turn is not None

    def is_like(self, other: Embedding) -> bool:
        """Say whether both map placements to the same points."""
        parts = ((each.linear, each.left, each.right) for each in (self, other))
        alike = all(map(np.array_equal, *parts))
        return alike and (self.scale, self.of_one_turn) == (other.scale, other.of_one_turn)

    def points(self, rotations: Array, translations: Array) -> Array:
        """Map n placements to points, (n, d) [m].

        Args:
            rotations: (n, 3, 3).
            translations: (n, 3) [m].
        """
        parts = [translations @ self.linear.T]
        if self.scale:
            whole = self.left is self.right  # the identity, of a task on the whole orientation
            turned = rotations if whole else self.left @ (rotations @ self.right)
            if self.of_one_turn:
                cosine = turned[:, 0, 0] + turned[:, 1, 1]
                sine = turned[:, 1, 0] - turned[:, 0, 1]
                length = np.maximum(np.hypot(cosine, sine), SHORTEST) / sqrt(2)
                turned = np.stack([cosine, sine], axis=1) / length[:, None]
            parts.append(self.scale * turned.reshape(len(turned), -1))
        points: Array = np.concatenate(parts, axis=1)
        return points

    def beside(self, placements: Placements, targets: Placements, at: Array | None = None) -> Array:
        """Map n placements to points as far from those of their targets as the task's errors are.

        An angle e is a chord 2 L sin(e/2), as in d6. Where points have all distances (not
        `by_error`) they are just `points`.

        Args:
            placements: rotations (n, 3, 3) and translations (n, 3) [m].
            targets: the same of the targets.
            at: the points of the targets, (n, d) [m]; default: computed.
        """
        own = self.points(*placements)
        if not self.by_error:
            return own
        wanted = self.points(*targets)
        at = wanted if at is None else at
        found = at + (own - wanted)
        (R, p), (R_d, p_d) = placements, targets
        if self.turning:
            rows = list(self.turning)
            error = np.einsum("kji,kj->ki", R, p_d - p)[:, rows]
            found[:, :3] = at[:, :3] - np.einsum("kij,kj->ki", R_d[:, :, rows], error)
        if self.turn is not None:
            assert self.robot is not None
            pairs = zip(np.swapaxes(R, 1, 2) @ R_d, R, strict=True)
            turns = [orientation_error(self.robot, Q, each, [self.turn]) for Q, each in pairs]
            # Of the axes across y, the second turns to the first.
            back = np.array(turns)[:, self.turn] * (1.0 if self.turn == 1 else -1.0)
            cosine, sine = np.cos(back), np.sin(back)
            x, y = at[:, -2], at[:, -1]
            found[:, -2:] = np.stack([cosine * x - sine * y, sine * x + cosine * y], axis=1)
        return found


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
    tilts = [row - 3 for row in robot.movable_rows if row >= 3]
    # Where weights leave rows out, the error is not that of the rows that are left.
    own = isinstance(task, FRAME_TASKS) and len(kept) == len(rows)
    turning = () if world or not own or _keep_their_span(linear, tilts) else tuple(linear.tolist())
    P = identity if len(linear) == 3 or turning else (identity if world else axes.T)[linear]
    turn = int(angular[0]) if own and len(angular) == 1 and len(tilts) > 1 else None
    free = np.setdiff1d(np.arange(3), angular)
    left, right, scale, of_one_turn = identity, identity, length, False
    if len(angular) == 3:
        scale = length / sqrt(2)
    elif len(angular) == 2:
        left, right = (identity[free], identity) if world else (identity, identity[:, free])
    elif len(angular) == 1:
        scale = length / sqrt(2)
        left, right = (identity, axes.T) if world else (axes.T, identity)
        left, right = left[free], right[:, free]
        of_one_turn = turn is not None or 2 in robot.movable_rows  # about other axes as well
    else:
        scale = 0.0
    return Embedding(P, left, right, scale, of_one_turn, turning, turn, robot)


def _keep_their_span(linear: Array, tilts: list[int]) -> bool:
    """Say whether turns about some axes keep the span of linear rows: all, none, or one's plane."""
    across = {axis for axis in range(3) if (axis in linear) == (len(linear) == 1)}
    return len(linear) in (0, 3) or set(tilts) <= across
