"""A scene for a page that moves it by itself: the robot once, what surrounds it per scenario.

Nodes, all in the world's frame (z up):

    /robot              the base;  /robot/body  its mesh
    /robot/1/2/...      the joints, nested, by Pinocchio's index;  .../body  the mesh of each
    .../tool            the task frame, at the joint that carries it;  .../tool/payload  a load
    /target             the frame that the task frame is to follow
    /obstacles/0 ...    the obstacles
    /path               the path of the target (drawn by `drawLine` of `replay.js`)

`replay_script` has the functions that open, fill and move such a scene in the browser.
"""

from __future__ import annotations

import base64
from dataclasses import asdict, dataclass
from importlib.resources import files
from typing import Any

import numpy as np

from dikbench.arrays import Array
from dikbench.robots.robot import Robot
from dikbench.scenario.scenario import Scenario
from dikbench.viewer.moving_joints import moving_joints
from dikbench.viewer.nodes import (
    add_obstacles,
    add_payload,
    add_robot,
    add_target,
    camera_of,
    path_points,
    points_in_view,
    robot_points,
    side_of,
)
from dikbench.viewer.viser_client import messages_of, viser_server


@dataclass(frozen=True)
class StaticScene:
    """The scene of one robot.

    Attributes:
        data: the serialised scene in base64, for `window.__VISER_EMBED_DATA__` of the client.
        joints: `MovingJoint` of each joint as a dictionary, with the name of its mesh as "body",
            empty where it carries none.
    """

    data: str
    joints: list[dict[str, Any]]


def static_scene(robot: Robot) -> StaticScene:
    """Build the scene of a robot: its simplified meshes, its task frame, the target's frame.

    It serves every scenario of the robot (see `surroundings`).

    Raises:
        DikbenchError: if viser is missing.
    """
    with viser_server() as server:
        bodies = add_robot(server.scene, robot)
        add_target(server.scene, robot)
        points = robot_points(robot, robot.q0[None])
        camera_of(points, side_of(robot, points)).place(server)
        data = base64.b64encode(server.get_scene_serializer().serialize()).decode()
    joints = [
        {**asdict(joint), "body": body}
        for joint, body in zip(moving_joints(robot), bodies[1:], strict=True)
    ]
    return StaticScene(data, joints)


@dataclass(frozen=True)
class Surroundings:
    """What a scenario adds to the scene of its robot.

    Attributes:
        messages: what adds obstacles and payload, and places the camera, for the client's queue.
        path: points of the path of the target, (k, 3) [m], rounded to 0.1 mm; one of a target at
            rest.
    """

    messages: list[dict[str, Any]]
    path: list[list[float]]


def surroundings(scenario: Scenario, q: Array | None = None) -> Surroundings:
    """Describe obstacles, payload, path and camera of a scenario.

    Args:
        scenario: which.
        q: configurations (n, nq) that the camera is to see; default: the start.

    Raises:
        DikbenchError: if viser is missing.
    """
    robot, path = scenario.robot, path_points(scenario)
    with viser_server() as server:
        before = len(messages_of(server))
        add_obstacles(server.scene, scenario)
        add_payload(server.scene, robot)
        seen = points_in_view(scenario, scenario.q0[None] if q is None else q)
        camera_of(seen, side_of(robot, path)).place(server)
        messages = messages_of(server)[before:]
    for message in messages:
        if "initial" in message:  # a scene that has its first camera already takes no other one
            message["initial"] = False
    return Surroundings(messages, np.round(path, 4).tolist())


def replay_script() -> str:
    """Read the functions of `assets/replay.js`, which move a scene in the browser."""
    return (files("dikbench.viewer") / "assets" / "replay.js").read_text(encoding="utf-8")
