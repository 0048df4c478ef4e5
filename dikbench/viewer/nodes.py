"""The nodes of a scene: robot, target, obstacles, payload; and from where it is seen."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import product
from typing import TYPE_CHECKING, Final

import numpy as np
import pinocchio as pin

from dikbench.arrays import Array
from dikbench.robots.collision.obstacles import (
    BoxObstacle,
    CapsuleObstacle,
    SphereObstacle,
)
from dikbench.robots.robot import Robot
from dikbench.scenario.scenario import Scenario
from dikbench.viewer.legend import GREY, OBSTACLE_COLOUR, PAYLOAD_COLOUR, TARGET_COLOUR, Rgb
from dikbench.viewer.moving_joints import ROBOT_NODE, body_node, joint_nodes, wxyz
from dikbench.viewer.simplified_meshes import simplified_meshes
from dikbench.viewer.tube import tube

if TYPE_CHECKING:
    import viser

TARGET_NODE: Final = "/target"
"""Node of the frame that the task frame is to follow."""

PATH_NODE: Final = "/path"
"""Node of the path of the target."""

OBSTACLES_NODE: Final = "/obstacles"
"""Node of the obstacles, which are below it by their number."""

TUBE_RADIUS_SHARE: Final = 0.007
"""Radius of the path of the target, as a share of the robot's size."""

PATH_POINTS: Final = 200

CAMERA_YAW_RAD: Final = np.deg2rad(50)
"""Angle about the vertical from the direction of the path to that of the camera."""

FIELD_OF_VIEW_RAD: Final = 0.75

WIDTH_OVER_HEIGHT: Final = 1.1
"""What a window has at least, less the room of the captions."""

SMALLEST_RADIUS_M: Final = 0.25
"""Radius about the middle that a camera sees at least."""

FARTHEST_EDGE_M: Final = 0.4
"""How much of an obstacle is taken into view, from its middle."""


@dataclass(frozen=True)
class Camera:
    """Where one looks from, and at what, (3,) [m] each."""

    position: tuple[float, ...]
    look_at: tuple[float, ...]

    def place(self, server: viser.ViserServer) -> None:
        """Make it the camera of a server's scene."""
        server.initial_camera.position = np.array(self.position)
        server.initial_camera.look_at = np.array(self.look_at)
        server.initial_camera.fov = FIELD_OF_VIEW_RAD


def tool_node(robot: Robot, robot_node: str = ROBOT_NODE) -> str:
    """Return the name of the node of the task frame."""
    joint = robot.model.frames[robot.frame_id].parentJoint
    return f"{joint_nodes(robot.model, robot_node)[joint]}/tool"


def add_robot(scene: viser.SceneApi, robot: Robot, robot_node: str = ROBOT_NODE) -> list[str]:
    """Add a robot at its neutral configuration: nested frames, a mesh per joint, the task frame.

    Returns:
        The names of the nodes of the meshes by Pinocchio's index of their joint, the universe
        first; empty where a joint carries none.
    """
    model, nodes = robot.model, joint_nodes(robot.model, robot_node)
    for node, placement in zip(nodes, model.jointPlacements, strict=True):
        scene.add_frame(
            node,
            show_axes=False,
            position=placement.translation,
            wxyz=np.array(wxyz(placement.rotation)),
        )
    names = [""] * model.njoints
    for joint, mesh in simplified_meshes(robot).items():
        names[joint] = body_node(nodes[joint])
        scene.add_mesh_simple(
            names[joint],
            mesh.vertices.astype(np.float32),
            mesh.faces.astype(np.uint32),
            color=GREY,
            flat_shading=True,
            cast_shadow=False,
            receive_shadow=False,
        )
    frame, size = model.frames[robot.frame_id], _size(robot)
    scene.add_frame(
        tool_node(robot, robot_node),
        position=frame.placement.translation,
        wxyz=np.array(wxyz(frame.placement.rotation)),
        axes_length=0.08 * size,
        axes_radius=0.005 * size,
    )
    return names


def add_target(scene: viser.SceneApi, robot: Robot, node: str = TARGET_NODE) -> viser.FrameHandle:
    """Add the frame of the target, in the world's place."""
    size = _size(robot)
    return scene.add_frame(node, axes_length=0.14 * size, axes_radius=0.004 * size)


def add_path(scene: viser.SceneApi, scenario: Scenario, node: str = PATH_NODE) -> None:
    """Add the path of the target as a tube, through which the task frame's own is seen."""
    made = tube(path_points(scenario), TUBE_RADIUS_SHARE * _size(scenario.robot))
    if made is not None:
        scene.add_mesh_simple(
            node,
            made.vertices.astype(np.float32),
            made.faces.astype(np.uint32),
            color=TARGET_COLOUR,
            opacity=0.4,
            side="double",
            cast_shadow=False,
            receive_shadow=False,
        )


def add_payload(scene: viser.SceneApi, robot: Robot, robot_node: str = ROBOT_NODE) -> None:
    """Add the ball that a robot carries, if it does, below the node of its task frame."""
    if robot.payload_radius > 0:
        _add_ball(
            scene,
            f"{tool_node(robot, robot_node)}/payload",
            np.zeros(3),
            robot.payload_radius,
            PAYLOAD_COLOUR,
        )


def add_obstacles(
    scene: viser.SceneApi, scenario: Scenario, obstacles_node: str = OBSTACLES_NODE
) -> None:
    """Add the obstacles of a scenario."""
    for number, obstacle in enumerate(scenario.obstacles):
        node = f"{obstacles_node}/{number}"
        _, placement = obstacle.geometry()
        at, turn = placement.translation, np.array(wxyz(placement.rotation))
        if isinstance(obstacle, SphereObstacle):
            _add_ball(scene, node, at, obstacle.radius, OBSTACLE_COLOUR)
        elif isinstance(obstacle, BoxObstacle):
            scene.add_box(
                node, OBSTACLE_COLOUR, obstacle.size, position=at, wxyz=turn, cast_shadow=False
            )
        else:
            _add_capsule(scene, node, obstacle, at, turn)


def path_points(scenario: Scenario) -> Array:
    """Compute points of the path of the target, (k, 3) [m]; one where it stands still."""
    reference = scenario.reference
    count = PATH_POINTS if reference.moving else 1
    return reference.placements(np.linspace(0.0, reference.duration, count))[1]


def obstacle_points(scenario: Scenario) -> Array:
    """Return points (k, 3) [m] at the edge of the obstacles of a scenario."""
    found = [np.empty((0, 3))]
    for obstacle in scenario.obstacles:
        shape, placement = obstacle.geometry()
        shape.computeLocalAABB()
        away = min(float(shape.aabb_radius), FARTHEST_EDGE_M)
        found.append(placement.translation + away * np.vstack([np.eye(3), -np.eye(3)]))
    return np.vstack(found)


def robot_points(robot: Robot, q: Array) -> Array:
    """Return points (k, 3) [m] at the edges of a robot at configurations (n, nq), all links'."""
    model, data, found = robot.model, robot.model.createData(), []
    corners = {
        joint: np.array(list(product(*zip(*_ends(mesh.vertices), strict=True))))
        for joint, mesh in simplified_meshes(robot).items()
    }
    for configuration in q:
        pin.forwardKinematics(model, data, configuration)
        tip = pin.updateFramePlacement(model, data, robot.frame_id).translation
        found.append(tip.copy()[None])
        for joint, points in corners.items():
            X = data.oMi[joint]
            found.append(points @ X.rotation.T + X.translation)
    return np.vstack(found)


def side_of(robot: Robot, points: Array) -> Array:
    """Choose the direction (3,) from which to see the way of a robot through points (k, 3) [m].

    A planar arm is seen from above, others from beside the way to its points, somewhat above.
    """
    if 2 not in robot.movable_rows:
        return np.array([0.0, -0.01, 1.0])
    x, y, _ = points.mean(axis=0)
    towards = np.arctan2(y, x) - CAMERA_YAW_RAD
    side = np.array([np.cos(towards), np.sin(towards), 0.45])
    unit: Array = side / np.linalg.norm(side)
    return unit


def right_of(side: Array) -> Array:
    """Return what is to the right (3,) for one who looks from a side (3,), horizontally."""
    right = np.cross(-side, [0.0, 0.0, 1.0])
    unit: Array = right / np.linalg.norm(right)
    return unit


def points_in_view(scenario: Scenario, q: Array) -> Array:
    """Return points (k, 3) [m] of a robot at configurations (n, nq), of its path and obstacles."""
    points = [robot_points(scenario.robot, q), path_points(scenario), obstacle_points(scenario)]
    return np.vstack(points)


def camera_of(points: Array, side: Array) -> Camera:
    """Place a camera on one side (3,) of points (k, 3) [m] such that it sees them all."""
    right = right_of(side)
    axes = np.array([right, np.cross(right, -side), side])  # to the right, up, to the camera
    low, high = _ends(points @ axes.T)
    middle = (low + high) / 2 @ axes
    width, height, depth = (high - low) / 2
    half = max(1.1 * height, width / WIDTH_OVER_HEIGHT, SMALLEST_RADIUS_M)
    position = middle + (depth + half / np.tan(FIELD_OF_VIEW_RAD / 2)) * side
    return Camera(tuple(np.round(position, 4).tolist()), tuple(np.round(middle, 4).tolist()))


def _ends(points: Array) -> tuple[Array, Array]:
    return points.min(axis=0), points.max(axis=0)


def _size(robot: Robot) -> float:
    """Estimate how large a robot is [m]."""
    points = robot_points(robot, robot.q0[None])
    return max(float(np.linalg.norm(np.ptp(points, axis=0))), 2 * SMALLEST_RADIUS_M)


def _add_ball(scene: viser.SceneApi, node: str, at: Array, radius: float, colour: Rgb) -> None:
    scene.add_icosphere(node, radius, colour, position=at, cast_shadow=False, receive_shadow=False)


def _add_capsule(
    scene: viser.SceneApi, node: str, capsule: CapsuleObstacle, at: Array, turn: Array
) -> None:
    length = float(np.linalg.norm(np.subtract(capsule.end, capsule.start)))
    scene.add_cylinder(
        node,
        capsule.radius,
        length,
        OBSTACLE_COLOUR,
        position=at,
        wxyz=turn,
        cast_shadow=False,
        receive_shadow=False,
    )
    for name, end in (("start", -length / 2), ("end", length / 2)):
        _add_ball(
            scene,
            f"{node}/{name}",
            np.array([0.0, 0.0, end]),
            capsule.radius,
            OBSTACLE_COLOUR,
        )
