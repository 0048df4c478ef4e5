"""The motion of a replay, as keyframes for the browser."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Final, Self

import numpy as np
import numpy.typing as npt
import pinocchio as pin
from meshcat.animation import Animation

from dikbench.arrays import Array
from dikbench.viewer.limit_use import Nearness
from dikbench.viewer.recording import Recording

FRAMES_PER_SECOND: Final = 50
"""Keyframes of the replay; the browser interpolates between them."""


@dataclass(frozen=True, eq=False)
class Moving:
    """A recorded motion before each of n control steps and after the last.

    Attributes:
        dt: control period [s].
        q: configurations, (n + 1, nq).
        tips: placements of the task frame in the world (`pinocchio.SE3`), n + 1.
        targets: placements of the reference, n + 1.
        joints: origins of the joints in the world, (n + 1, joints, 3) [m].
        nearness: nearness of each joint to its limits, (n + 1, joints).
    """

    dt: float
    q: Array
    tips: list[Any]
    targets: list[Any]
    joints: Array
    nearness: npt.NDArray[np.int_]

    @classmethod
    def of(cls, recording: Recording, nearness: npt.NDArray[np.int_]) -> Self:
        """Compute the motion of a recording; the nearness is given per velocity, (n + 1, nv)."""
        robot, trace = recording.scenario.robot, recording.trace
        model, data = robot.model, robot.model.createData()
        tips, origins = [], []
        for q in trace.q:
            pin.forwardKinematics(model, data, q)
            tips.append(pin.updateFramePlacement(model, data, robot.frame_id).copy())
            origins.append([placement.translation.copy() for placement in data.oMi[1:]])
        return cls(
            trace.dt,
            trace.q,
            tips,
            [recording.scenario.reference.placement(float(tau)) for tau in trace.tau],
            np.array(origins),
            np.column_stack(
                [nearness[:, j.idx_v : j.idx_v + j.nv].max(axis=1) for j in model.joints[1:]]
            ),
        )


def animation(viewer: Any, view: Any, moving: Moving, speed: float) -> Any:
    """Build the keyframes of a replay (`meshcat.animation.Animation`).

    Args:
        viewer: the `meshcat.Visualizer`, with the nodes `target`, `tool` and `joints`.
        view: the `MeshcatVisualizer` of the robot.
        moving: the motion.
        speed: speed of the replay over the robot's.
    """
    last = len(moving.q) - 1
    stride = max(1, round(speed / (moving.dt * FRAMES_PER_SECOND)))
    frames = Animation(default_framerate=speed / moving.dt)
    for step in [*range(0, last, stride), last]:
        _place(frames, step, viewer["target"], moving.targets[step].homogeneous)
        _place(frames, step, viewer["tool"], moving.tips[step].homogeneous)
        pin.forwardKinematics(view.model, view.data, moving.q[step])
        pin.updateGeometryPlacements(view.model, view.data, view.visual_model, view.visual_data)
        drawn = zip(view.visual_model.geometryObjects, view.visual_data.oMg, strict=True)
        for body, placement in drawn:
            node = viewer[view.getViewerNodeName(body, pin.GeometryType.VISUAL)]
            _place(frames, step, node, placement.homogeneous)
        for number, origin in enumerate(moving.joints[step]):
            node = viewer[f"joints/{number}"]
            _place(frames, step, node, pin.SE3(np.eye(3), origin).homogeneous)
            for state in Nearness:
                shown = bool(moving.nearness[step, number] == state)
                with frames.at_frame(node[state.name.lower()], step) as frame:
                    frame.set_property("visible", "boolean", shown)
    return frames


def _place(frames: Any, step: int, node: Any, placement: Array) -> None:
    with frames.at_frame(node, step) as frame:
        frame.set_transform(placement)
