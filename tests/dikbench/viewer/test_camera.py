"""What the camera of a replay sees: all of the motion, in a window that is not too narrow."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from dikbench.arrays import Array
from dikbench.plugins.building import make_scenario
from dikbench.viewer.nodes import WIDTH_OVER_HEIGHT, robot_points
from dikbench.viewer.static_scene import surroundings

pytest.importorskip("viser", reason="viser is not installed: pip install 'dikbench[replay]'")


def on_screen(messages: list[dict[str, Any]], points: Array) -> Array:
    """Where points (k, 3) [m] are seen: right and up in half heights of the window, (k, 2)."""
    said = {message["type"]: message for message in messages}
    at = np.array(said["SetCameraPositionMessage"]["position"])
    view = np.array(said["SetCameraLookAtMessage"]["look_at"]) - at
    forward = view / np.linalg.norm(view)
    right = np.cross(forward, [0.0, 0.0, 1.0])
    right /= np.linalg.norm(right)
    depth = (points - at) @ forward
    assert (depth > 0).all()
    half = np.tan(said["SetCameraFovMessage"]["fov"] / 2) * depth
    up = np.cross(right, forward)
    seen: Array = np.column_stack([(points - at) @ right, (points - at) @ up]) / half[:, None]
    return seen


@pytest.mark.parametrize("robot", ["panda", "planar3r"])
def test_all_of_the_motion_is_seen(robot: str) -> None:
    """The arm stretched out far from its start, up and down, is in view, and fills it."""
    scenario = make_scenario(f"reach[robot={robot}]")
    q = np.random.default_rng(7).uniform(-2.0, 2.0, (6, scenario.robot.model.nq))
    seen = on_screen(surroundings(scenario, q).messages, robot_points(scenario.robot, q))
    largest = np.abs(seen).max(axis=0) / [WIDTH_OVER_HEIGHT, 1.0]
    assert (largest <= 1).all()
    assert largest.max() > 0.6
    start = surroundings(scenario).messages
    assert np.abs(on_screen(start, robot_points(scenario.robot, q))).max() > 1
