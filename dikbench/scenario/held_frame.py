"""Frames that a task of the first priority holds in place, such as the feet of a humanoid."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import pinocchio as pin

from dikbench.arrays import Array
from dikbench.problem.embedding import FRAME_TASKS, Embedding, embedding_of
from dikbench.problem.tasks import Task, TrackingTask
from dikbench.robots.robot import Robot, frame_id


@dataclass(frozen=True, eq=False)
class HeldFrame:
    """A frame that is to stay at its target.

    Attributes:
        frame: Pinocchio's index of it.
        embedding: of its task.
        rotation: of the target, (3, 3).
        translation: of the target, (3,) [m].
    """

    frame: int
    embedding: Embedding
    rotation: Array
    translation: Array

    def away(self, rotations: Array, translations: Array) -> Array:
        """Compute how far placements are from the target, vectors in points' space (n, d) [m].

        Args:
            rotations: (n, 3, 3).
            translations: (n, 3) [m].
        """
        n = len(rotations)
        targets = self.rotation[None].repeat(n, 0), self.translation[None].repeat(n, 0)
        at = self.embedding.points(self.rotation[None], self.translation[None])
        return self.embedding.beside((rotations, translations), targets) - at


def held_frames(
    robot: Robot, tracking: TrackingTask, tasks: tuple[Task, ...], length: float
) -> tuple[HeldFrame, ...]:
    """Find the frames that are held by other tasks of the priority of the tracking.

    Args:
        robot: the robot.
        tracking: the task that follows the reference.
        tasks: the other tasks.
        length: L [m], the lever that turns angles into lengths.
    """
    held = []
    for task in tasks:
        if task.priority != tracking.priority or not isinstance(task, FRAME_TASKS):
            continue
        rotation, translation = _parts(task.target)
        embedding = embedding_of(task, robot, rotation, length)
        index = robot.frame_id if task.frame is None else frame_id(robot.model, task.frame)
        held.append(HeldFrame(index, embedding, rotation, translation))
    return tuple(held)


def _parts(target: pin.SE3 | Array) -> tuple[Array, Array]:
    """Rotation (3, 3) and translation (3,) of a placement, a point or a rotation."""
    if isinstance(target, pin.SE3):
        return target.rotation, target.translation
    if target.shape == (3,):
        return np.eye(3), target
    return target, np.zeros(3)
