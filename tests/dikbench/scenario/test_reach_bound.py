"""What is said to be out of reach, against searches, link lengths and postures that reach it."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pinocchio as pin
import pytest

from dikbench.arrays import Array
from dikbench.errors import DikbenchError
from dikbench.problem.embedding import embedding_of
from dikbench.problem.tasks import PoseTask, PositionTask
from dikbench.robots.catalogue import ROBOTS
from dikbench.robots.loading import load_robot
from dikbench.robots.robot import Robot
from dikbench.scenario import placement_of, solve_placement
from dikbench.scenario.reach_bound import is_out_of_reach

TOLERANCE_M = 0.005

ARMS = [name for name in ROBOTS if name not in ("base", "talos-humanoid")]


def _random_posture(robot: Robot, random: np.random.Generator) -> Array:
    limits = robot.limits.position
    assert limits is not None
    lower, upper = np.maximum(limits.lower, -np.pi), np.minimum(limits.upper, np.pi)
    angles = random.uniform(lower, np.maximum(upper, lower))
    posture: Array = pin.integrate(robot.model, pin.neutral(robot.model), angles)
    return posture


def _is_inside(robot: Robot, q: Array) -> bool:
    seen = robot.limits.at(q)
    assert seen.to_lower is not None
    assert seen.to_upper is not None
    return bool(min(seen.to_lower.min(), seen.to_upper.min()) >= -1e-3)


@pytest.mark.parametrize("name", ARMS)
@pytest.mark.parametrize("count", [3, pytest.param(100, marks=pytest.mark.long)])
def test_what_a_posture_reaches_is_never_out_of_reach(name: str, count: int) -> None:
    """Nor what is off by just less than the tolerance, in position and orientation at once."""
    robot, random = load_robot(name), np.random.default_rng(7)
    embedding = embedding_of(PoseTask(), robot, np.eye(3))
    for _ in range(count):
        X = placement_of(robot, _random_posture(robot, random))
        off = np.zeros(6)
        off[list(robot.task_rows)] = random.normal(size=len(robot.task_rows)) * 1e-3
        Y = X * pin.exp6(pin.Motion(off * np.repeat([1.0, 3.0], 3)))
        points = embedding.points(
            np.array([X.rotation, Y.rotation]), np.array([X.translation, Y.translation])
        )
        away = float(np.linalg.norm(points[1] - points[0]))
        for whole_pose in (True, False):
            assert not is_out_of_reach(robot, X, 1e-6, whole_pose=whole_pose)
            assert not is_out_of_reach(robot, Y, away, whole_pose=whole_pose)


@pytest.mark.parametrize("name", ["planar3r", "planar4r"])
@pytest.mark.parametrize("whole_pose", [True, False])
def test_no_search_finds_what_is_said_to_be_out_of_reach(name: str, whole_pose: bool) -> None:
    """From many seeds, over targets about the boundary; both answers occur."""
    robot, random = load_robot(name), np.random.default_rng(3)
    task = PoseTask() if whole_pose else PositionTask()
    out = 0
    for _ in range(25):
        angle, share, turn = random.uniform([0, 0.6, -3], [6.2, 1.25, 3])
        length = share * {"planar3r": 0.9, "planar4r": 1.0}[name]
        at = np.array([length * np.cos(angle), length * np.sin(angle), 0.0])
        target = pin.SE3(pin.utils.rotate("z", turn), at)
        if not is_out_of_reach(robot, target, TOLERANCE_M, whole_pose=whole_pose):
            continue
        out += 1
        for _ in range(15):
            try:
                seed = _random_posture(robot, random)
                q = solve_placement(robot, target, seed, tracking=task, iterations=40)
            except DikbenchError:
                continue
            assert not _is_inside(robot, q)
    assert 3 <= out <= 22


def test_a_planar_arm_reaches_as_far_as_its_links_are_long() -> None:
    """Links of 0.4, 0.3, 0.2 m: 0.9 m; with the orientation held the wrist reaches 0.7 m."""
    robot = load_robot("planar3r")

    def at(x: float, yaw: float = 0.0) -> pin.SE3:
        return pin.SE3(pin.utils.rotate("z", yaw), np.array([x, 0.0, 0.0]))

    for whole_pose in (True, False):
        assert not is_out_of_reach(robot, at(0.9), 1e-3, whole_pose=whole_pose)
        assert is_out_of_reach(robot, at(0.9 + 2e-3), 1e-3, whole_pose=whole_pose)
    # The last link points back by 2.5 rad: the wrist is farther out. It cannot by pi.
    tip = np.array([0.2 * np.cos(2.5), 0.2 * np.sin(2.5), 0.0])
    for wrist, out in ((0.699, False), (0.71, True)):
        back = pin.SE3(pin.utils.rotate("z", 2.5), np.array([wrist, 0.0, 0.0]) + tip)
        assert is_out_of_reach(robot, back, 1e-3, whole_pose=True) == out
        assert not is_out_of_reach(robot, back, 1e-3, whole_pose=False)
    assert is_out_of_reach(robot, at(0.499, np.pi), 1e-3, whole_pose=True)
    # Nothing is nearer to the base than the shortest of triangles allows: 0.4 < 0.3 + 0.2.
    assert not is_out_of_reach(robot, at(0.0), 1e-3, whole_pose=False)


def test_an_elbow_that_cannot_stretch_shortens_the_reach() -> None:
    """By the law of cosines, with the elbow bent by at least a right angle."""
    arm = load_robot("planar3r")
    bent = arm.with_limits(position=([-3.0, np.pi / 2, -3.0], [3.0, 3.0, 3.0]))
    bent = replace(bent, q0=np.array([0.0, 2.0, 0.0]))
    reach = np.hypot(0.4, 0.3) + 0.2
    for away, out in ((reach + 0.01, True), (reach - 0.001, False)):
        target = pin.SE3(np.eye(3), np.array([away, 0.0, 0.0]))
        assert is_out_of_reach(bent, target, 1e-3, whole_pose=False) == out
        assert not is_out_of_reach(arm, target, 1e-3, whole_pose=False)


def test_robots_with_other_joints_are_never_out_of_reach() -> None:
    """A base that drives, a humanoid whose base is free: nothing is proven of them."""
    far = pin.SE3(np.eye(3), np.array([50.0, 0.0, 0.0]))
    for name in ("base", "talos-humanoid"):
        assert not is_out_of_reach(load_robot(name), far, 1e-3, whole_pose=False)
