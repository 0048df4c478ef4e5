"""One or two recordings in a scene of viser, side by side, at one of their frames."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Final

import numpy as np

from dikbench.arrays import Array, Indices
from dikbench.viewer.frames import Frames, common_times
from dikbench.viewer.legend import COLOURS, PATH_COLOURS, names_of
from dikbench.viewer.limit_use import Nearness
from dikbench.viewer.moving_joints import moving_joints
from dikbench.viewer.nodes import (
    add_obstacles,
    add_path,
    add_payload,
    add_robot,
    add_target,
    camera_of,
    obstacle_points,
    path_points,
    right_of,
    robot_points,
    side_of,
)
from dikbench.viewer.recording import Recording

if TYPE_CHECKING:
    import viser

GAP_SHARE: Final = 0.25
"""Room between two robots, as a share of their width."""

ACHIEVED_WIDTH, NEAREST_WIDTH = 3.0, 3.0
"""Widths of lines in pixels."""

FLOOR_MARGIN_M: Final = 0.5

LABEL_SHARE: Final = 0.06
"""Height of a label above what it names, as a share of that's height."""

POSES_IN_VIEW: Final = 9
"""Configurations of each robot that the camera takes into view."""


class ReplayScene:
    """The scene of one or two recordings.

    Attributes:
        times: times of the frames [s].
    """

    def __init__(
        self, server: viser.ViserServer, recordings: list[Recording], speed: float
    ) -> None:
        self.times = common_times(recordings, speed)
        side = side_of(recordings[0].scenario.robot, path_points(recordings[0].scenario))
        points = [_points(recording, side) for recording in recordings]
        offsets = _side_by_side(points, side)
        named = zip(recordings, names_of(recordings), offsets, points, strict=True)
        self._shown = [
            _Shown(server.scene, recording, name, self.times, f"/trial{number}", at, cloud)
            for number, (recording, name, at, cloud) in enumerate(named)
        ]
        everything = np.vstack([cloud + at for cloud, at in zip(points, offsets, strict=True)])
        camera_of(everything, side).place(server)
        _add_floor(server.scene, everything)
        self.show(0)

    def show(self, frame: int) -> None:
        """Put everything where it was at a frame."""
        for shown in self._shown:
            shown.show(frame)


class _Shown:
    """One recording in a scene, below a node of its own."""

    def __init__(
        self,
        scene: viser.SceneApi,
        recording: Recording,
        name: str,
        times: Array,
        node: str,
        offset: Array,
        points: Array,
    ) -> None:
        self._frames = Frames.of(recording, times)
        self._end = recording.trace.steps * recording.trace.dt
        self._name = name
        robot, scenario = recording.scenario.robot, recording.scenario
        scene.add_frame(node, show_axes=False, position=offset)
        robot_node = f"{node}/robot"
        bodies = add_robot(scene, robot, robot_node)
        add_payload(scene, robot, robot_node)
        add_obstacles(scene, scenario, f"{node}/obstacles")
        self._target = add_target(scene, robot, f"{node}/target")
        self._joints = moving_joints(robot, robot_node)
        # Handles of any kind, whose attributes depend on the node.
        self._handles: list[Any] = [scene.get_handle_by_name(each.node) for each in self._joints]
        self._bodies: list[Any] = [scene.get_handle_by_name(body) for body in bodies[1:]]
        self._colours = [Nearness.INSIDE] * len(self._joints)
        add_path(scene, scenario, f"{node}/path")
        colours = np.array([PATH_COLOURS[Nearness(k)] for k in self._frames.worst_of_steps])
        _add_line(scene, f"{node}/achieved", self._frames.tips, colours, ACHIEVED_WIDTH)
        self._nearest: viser.LineSegmentsHandle | None = None
        if self._frames.nearest is not None:
            self._nearest = scene.add_line_segments(
                f"{node}/nearest",
                self._frames.nearest[0][:1].astype(np.float32),
                COLOURS[Nearness.NEAR],
                thickness=NEAREST_WIDTH,
                thickness_units="screen",
            )
        self._label = scene.add_label(
            f"{node}/label", self._name, position=points[-1], anchor="bottom-center"
        )

    def show(self, frame: int) -> None:
        frames = self._frames
        row, nearness = frames.coordinates[frame], frames.nearness(frame)
        moved = zip(self._joints, self._handles, self._bodies, strict=True)
        for number, (joint, handle, body) in enumerate(moved):
            position, turn = joint.pose(row)
            if joint.kind != "turn":
                handle.position = position
            if joint.kind != "slide":
                handle.wxyz = turn
            state = Nearness(nearness[number])
            if body is not None and state != self._colours[number]:
                self._colours[number] = state
                body.color = COLOURS[state]
        self._target.position, self._target.wxyz = np.split(frames.targets[frame], [3])
        if self._nearest is not None and frames.nearest is not None:
            self._nearest.points = frames.nearest[0][frame][None].astype(np.float32)
            worst = Nearness(frames.states["distance"][frame].max(initial=0))
            self._nearest.colors = np.array(PATH_COLOURS[worst], dtype=np.uint8)
        self._label.text = self._said(frame)

    def _said(self, frame: int) -> str:
        """Say in a line what is shown, and what is broken."""
        time = min(float(self._frames.times[frame]), self._end)
        past = self._frames.past(frame)
        said = f"{self._name}   {time:.2f} s"
        if self._frames.nearest is not None:
            said += f"   distance {1000 * self._frames.nearest[1][frame]:.0f} mm"
        return said + (f"   past its limit: {', '.join(past)}" if past else "")


def _points(recording: Recording, side: Array) -> Array:
    """Points (k, 3) [m] that the camera on one side is to see; the last one is for a label."""
    scenario, q = recording.scenario, recording.trace.q
    chosen = np.linspace(0, len(q) - 1, POSES_IN_VIEW).astype(int)
    robot = robot_points(scenario.robot, q[chosen])
    points = np.vstack([robot, path_points(scenario), obstacle_points(scenario)])
    up = np.cross(right_of(side), -side)
    heights, middle = points @ up, (points.max(axis=0) + points.min(axis=0)) / 2
    above = heights.max() - middle @ up + LABEL_SHARE * np.ptp(heights)
    return np.vstack([points, middle + above * up])


def _side_by_side(points: list[Array], side: Array) -> list[Array]:
    """Choose where to put clouds of points (k, 3) so that they stand beside each other, (3,)."""
    right = right_of(side)
    across = [cloud @ right for cloud in points]
    gap = GAP_SHARE * max(float(np.ptp(each)) for each in across)
    offsets, edge = [np.zeros(3)], float(across[0].max())
    for each in across[1:]:
        offsets.append((edge + gap - each.min()) * right)
        edge += gap + float(np.ptp(each))
    return offsets


def _add_floor(scene: viser.SceneApi, points: Array) -> None:
    low, high = points[:, :2].min(axis=0), points[:, :2].max(axis=0)
    middle, width = (low + high) / 2, high - low + 2 * FLOOR_MARGIN_M
    scene.add_grid(
        "/floor",
        width=float(width[0]),
        height=float(width[1]),
        cell_size=0.25,
        section_size=1.0,
        shadow_opacity=0.0,
        position=(*middle, 0.0),
    )


def _add_line(
    scene: viser.SceneApi, node: str, points: Array, colours: Indices, width: float
) -> None:
    """Draw a line through points (k, 3) in colours of its points, (k, 3)."""
    if len(points) < 2:
        return
    segments = np.stack([points[:-1], points[1:]], axis=1).astype(np.float32)
    of_ends = np.stack([colours[:-1], colours[:-1]], axis=1).astype(np.uint8)
    scene.add_line_segments(node, segments, of_ends, thickness=width, thickness_units="screen")
