"""A recording as a meshcat scene: robot, target, paths and limits."""

from __future__ import annotations

from typing import Any, Final

import meshcat.geometry as shapes
import numpy as np
import pinocchio as pin
from pinocchio.visualize import MeshcatVisualizer

from dikbench.arrays import Array, Indices
from dikbench.report.figures.scenario_drawing import stick
from dikbench.robots.robot import Robot
from dikbench.viewer.animation import Moving, animation
from dikbench.viewer.legend import COLOURS, TARGET_COLOUR
from dikbench.viewer.limit_use import Nearness, nearness
from dikbench.viewer.recording import Recording
from dikbench.viewer.visuals import bodies

AXIS_COLOURS: Final = (0xFF0000, 0x00AA00, 0x0000FF)
"""The usual colours of x, y, z."""

CAMERA_YAW_RAD: Final = np.deg2rad(50)
"""Angle about the vertical from the direction of the path to that of the camera."""

CYLINDER_ROTATIONS: Final = tuple(
    pin.SE3(pin.utils.rotate(axis, angle), np.zeros(3))
    for axis, angle in (("z", -np.pi / 2), ("z", 0.0), ("x", np.pi / 2))
)
"""Rotations of a cylinder, which meshcat makes along y, to x, y, z."""


def build_scene(viewer: Any, recording: Recording, speed: float) -> None:
    """Fill a meshcat viewer with a recording and play it repeatedly.

    Args:
        viewer: a `meshcat.Visualizer`.
        recording: the trial.
        speed: of the replay; 2 is twice as fast as the robot.
    """
    robot, trace = recording.scenario.robot, recording.trace
    view = MeshcatVisualizer(robot.model, None, bodies(robot))
    view.initViewer(viewer)
    view.loadViewerModel("robot")
    view.display(trace.q[0])
    moving = Moving.of(recording, nearness(trace, robot.limits))
    desired = np.array([target.translation for target in moving.targets])
    achieved = np.array([tip.translation for tip in moving.tips])
    points = np.vstack([stick(robot, trace.q[0]), stick(robot, trace.q[-1]), desired, achieved])
    size = float(np.linalg.norm(np.ptp(points, axis=0)))
    _look_at(viewer, points, _side(robot, desired), size)
    _draw_path(viewer["target path"], desired, np.full(len(desired), TARGET_COLOUR), 0.004 * size)
    worst = moving.nearness.max(axis=1, initial=Nearness.INSIDE)
    colours = np.array([COLOURS[Nearness(value)] for value in worst])
    _draw_path(viewer["achieved path"], achieved, colours, 0.008 * size)
    _draw_axes(viewer["target"], 0.12 * size, 0.003 * size)
    _draw_axes(viewer["tool"], 0.06 * size, 0.004 * size)
    for number in range(moving.joints.shape[1]):
        for state, colour in COLOURS.items():
            node = viewer[f"joints/{number}/{state.name.lower()}"]
            material = shapes.MeshLambertMaterial(color=colour, opacity=0.8, depthTest=False)
            node.set_object(shapes.Sphere(0.02 * size), material)
    viewer.set_animation(animation(viewer, view, moving, speed), repetitions=float("inf"))


def _look_at(viewer: Any, points: Array, side: Array, size: float) -> None:
    """Put the camera to one side (3,) of points (k, 3).

    meshcat's camera always looks at the origin, so that the world is moved there.
    """
    middle = (points.max(axis=0) + points.min(axis=0)) / 2
    for name in ("/meshcat", "/Axes"):
        viewer[name].set_transform(pin.SE3(np.eye(3), -middle).homogeneous)
    viewer["/Grid"].set_property("visible", False)
    for edge in ("top_color", "bottom_color"):
        viewer["/Background"].set_property(edge, [1.0, 1.0, 1.0])
    x, y, z = size * side
    camera = viewer["/Cameras/default/rotated/<object>"]
    camera.set_property("position", [x, z, -y])  # in axes with y up


def _side(robot: Robot, path: Array) -> Array:
    """Choose the side from which to see a path (k, 3): a planar arm's from above."""
    if 2 not in robot.movable_rows:
        return np.array([0.0, -0.01, 1.0])
    x, y, _ = path.mean(axis=0)
    towards = np.arctan2(y, x) - CAMERA_YAW_RAD
    return np.array([1.0 * np.cos(towards), 1.0 * np.sin(towards), 0.55])


def _draw_path(node: Any, points: Array, colours: Indices, width: float) -> None:
    """Draw a line through points (k, 3) and a dot at each: browsers draw thin lines only."""
    rgb = np.stack([(colours >> shift) % 256 for shift in (16, 8, 0)]) / 255
    position, colour = points.T.astype(np.float32), rgb.astype(np.float32)
    line = shapes.PointsGeometry(position, colour)
    node["line"].set_object(shapes.Line(line, shapes.LineBasicMaterial(vertexColors=True)))
    node["dots"].set_object(shapes.PointCloud(position, colour, size=width))


def _draw_axes(node: Any, length: float, radius: float) -> None:
    """Draw the axes of a frame as bars along x, y and z."""
    bar = pin.SE3(np.eye(3), np.array([0.0, length / 2, 0.0]))
    for name, turn, colour in zip("xyz", CYLINDER_ROTATIONS, AXIS_COLOURS, strict=True):
        material = shapes.MeshLambertMaterial(color=colour)
        node[name].set_object(shapes.Cylinder(length, radius), material)
        node[name].set_transform((turn * bar).homogeneous)
