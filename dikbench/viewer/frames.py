"""The motion of a replay at the instants that are shown."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final, Self

import numpy as np

from dikbench.arrays import Array, Indices
from dikbench.problem.constraints import CollisionConstraint
from dikbench.robots.kinematics import Kinematics, placements
from dikbench.viewer.limit_use import Nearness, Nearnesses, limit_states
from dikbench.viewer.moving_joints import joint_coordinates
from dikbench.viewer.recording import Recording
from dikbench.viewer.target_poses import target_poses

FRAMES_PER_SECOND: Final = 30

MOST_FRAMES: Final = 1200
"""A longer replay has fewer frames per second."""


@dataclass(frozen=True, eq=False)
class Frames:
    """A recorded motion at k times.

    Attributes:
        times: time of each frame [s]; a run that ended before stays where it was.
        coordinates: of the joints, (k, columns) (see `joint_coordinates`).
        targets: poses of the target, position and quaternion w, x, y, z, (k, 7).
        tips: the origin of the task frame before each control step and at the end, (n + 1, 3) [m].
        worst_of_steps: the worst nearness of all joints there, (n + 1,).
        states: nearness of each joint since the frame before by kind of limit, (k, joints) each.
        nearest: the nearest points of bodies or obstacles that must not touch, (k, 2, 3) [m], and
            their distance, (k,) [m]; None where no distance is to be kept.
    """

    times: Array
    coordinates: Array
    targets: Array
    tips: Array
    worst_of_steps: Nearnesses
    states: dict[str, Nearnesses]
    nearest: tuple[Array, Array] | None

    @classmethod
    def of(cls, recording: Recording, times: Array) -> Self:
        """Compute the motion of a recording at ascending times [s]."""
        robot, trace = recording.scenario.robot, recording.trace
        instants = np.minimum(np.round(times / trace.dt).astype(np.intp), trace.steps)
        kept, shown = np.unique(instants, return_inverse=True)
        states = limit_states(trace, recording.scenario, kept)
        everything = limit_states(trace, recording.scenario) if trace.steps else states
        return cls(
            times,
            joint_coordinates(robot, trace.q[kept])[shown],
            target_poses(recording.scenario, trace.tau[instants]),
            placements(robot, robot.frame_id, trace.q)[:, :3, 3],
            np.max([*everything.values()], axis=0).max(axis=1, initial=Nearness.INSIDE),
            {kind: found[shown] for kind, found in states.items()},
            _nearest(recording, instants),
        )

    def nearness(self, frame: int) -> Nearnesses:
        """Return the worst nearness of each joint at a frame, (joints,)."""
        worst: Nearnesses = np.max([found[frame] for found in self.states.values()], axis=0)
        return worst

    def past(self, frame: int) -> list[str]:
        """Name the kinds of limits that are broken at a frame."""
        return [
            kind for kind, found in self.states.items() if (found[frame] == Nearness.PAST).any()
        ]


def common_times(recordings: list[Recording], speed: float) -> Array:
    """Choose the times of the frames of a replay [s], from the start to the end of the longest.

    Args:
        recordings: the trials that are shown together.
        speed: speed of the replay over the robot's.
    """
    end = max(recording.trace.steps * recording.trace.dt for recording in recordings)
    step = min(recording.trace.dt for recording in recordings)
    count = min(np.ceil(end / speed * FRAMES_PER_SECOND), np.ceil(end / step), MOST_FRAMES)
    return np.linspace(0.0, end, int(count) + 1)


def _nearest(recording: Recording, instants: Indices) -> tuple[Array, Array] | None:
    robot = recording.scenario.robot
    pairs = [
        constraint.pairs(robot)
        for constraint in recording.scenario.constraints
        if isinstance(constraint, CollisionConstraint)
    ]
    if not pairs:
        return None
    kinematics, points, distances = Kinematics(robot), [], []
    for q in recording.trace.q[instants]:
        kinematics.update(q)
        found = []
        for each in pairs:
            each.distances(kinematics)
            found.append(each.nearest())
        distance, between = min(found, key=lambda pair: pair[0])
        distances.append(distance)
        points.append(between)
    return np.array(points), np.array(distances)
