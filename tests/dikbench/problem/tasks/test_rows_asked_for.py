"""Tasks on some rows of a twist only, in the axes of the frame or of the world."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pinocchio as pin
import pytest
from makers.scenarios import run_of
from makers.urdfs import SIX, write_arm

import dikbench
from dikbench.errors import DikbenchError
from dikbench.metrics import motion_of
from dikbench.plugins.building import make_scenario
from dikbench.problem import Array, Kinematics, OrientationTask, PoseTask, PositionTask, Robot
from dikbench.problem.embedding import embedding_of
from dikbench.problem.progress import CHARACTERISTIC_LENGTH_M
from dikbench.robots.loading import load_robot

STEP = 1e-6
ROWS = (
    "xyz",
    "rxryrz",
    "xyzrxry",
    "xyzryrz",
    "xyzrz",
    "zrx",
    "xyrz",
    "xry",
    "world:xy",
    "world:xyzrxry",
    "world:xyrz",
    "world:xyzrxryrz",
)


def arm(folder: Path, rows: str) -> Robot:
    """Load an arm of six joints that is asked for some rows."""
    return load_robot(write_arm(folder, SIX), "tool", rows=rows)


def moved_freely(robot: Robot, X: Any, random: np.random.Generator) -> Any:
    """Move a placement along what its rows leave free: a translation, a turn about one axis."""
    free = [row for row in range(6) if row not in robot.task_rows]
    twist = np.zeros(6)
    twist[free] = random.uniform(-0.5, 0.5, len(free))
    linear, angular = twist[:3], twist[3:]
    if sum(row >= 3 for row in free) == 2:
        angular[:] = 0.0  # turns about two axes do not leave the third alone
    if robot.task_axes == "body":
        linear[:] = 0.0  # the axes in which it is measured turn with the frame
    R, p = X.rotation, X.translation
    if robot.task_axes == "world":
        return pin.SE3(pin.exp3(angular) @ R, p + linear)
    return pin.SE3(R @ pin.exp3(angular), p + R @ linear)


def parts(X: Any) -> tuple[Array, Array]:
    """Return the rotation (1, 3, 3) and the translation (1, 3) of a placement."""
    return X.rotation[None], X.translation[None]


def error_at(robot: Robot, q: Array, target: Any) -> tuple[Array, Array]:
    """Compute the error and the Jacobian of the pose task."""
    kinematics = Kinematics(robot)
    kinematics.update(q)
    task = PoseTask().linearize(kinematics, target)
    return task.error, task.J


@pytest.mark.parametrize("rows", ROWS)
def test_what_is_not_asked_for_makes_no_error_and_the_jacobian_is_the_errors(
    rows: str, tmp_path: Path
) -> None:
    """By central differences about targets that differ in free directions only."""
    robot, random = arm(tmp_path, rows), np.random.default_rng(0)
    kinematics = Kinematics(robot)
    for _ in range(5):
        q = robot.q0 + random.uniform(-0.5, 0.5, 6)
        kinematics.update(q)
        target = moved_freely(robot, kinematics.placement(robot.frame_id), random)
        error, J = error_at(robot, q, target)
        np.testing.assert_allclose(error, 0.0, atol=1e-12)
        np.testing.assert_allclose(J, kinematics.task_jacobian(), atol=1e-15)
        for unit in np.eye(6):
            ahead, _ = error_at(robot, q + STEP * unit, target)
            behind, _ = error_at(robot, q - STEP * unit, target)
            np.testing.assert_allclose((ahead - behind) / (2 * STEP), -J @ unit, atol=1e-8)


@pytest.mark.parametrize("rows", ROWS)
def test_the_distance_from_the_path_looks_at_the_same(rows: str, tmp_path: Path) -> None:
    """It is zero along free directions and the error's length for small errors."""
    robot, random = arm(tmp_path, rows), np.random.default_rng(1)
    kinematics = Kinematics(robot)
    kinematics.update(robot.q0)
    X = kinematics.placement(robot.frame_id).copy()
    embedding = embedding_of(PoseTask(), robot, X.rotation)
    target, at = parts(X), embedding.points(*parts(X))

    def away(placement: Any) -> float:
        return float(np.linalg.norm(embedding.beside(parts(placement), target) - at))

    assert away(moved_freely(robot, X, random)) < 1e-12
    lever = np.array([1.0, 1.0, 1.0, *[CHARACTERISTIC_LENGTH_M] * 3])[list(robot.task_rows)]
    for _ in range(5):
        q = robot.q0 + 1e-6 * random.normal(size=6)
        error, _ = error_at(robot, q, X)
        kinematics.update(q)
        np.testing.assert_allclose(
            away(kinematics.placement(robot.frame_id)), np.linalg.norm(lever * error), rtol=1e-4
        )


@pytest.mark.parametrize("rows", ["xyz", "world:xyz", "xyzrz"])
def test_a_position_moves_along_the_straight_line(rows: str, tmp_path: Path) -> None:
    """Not along the first rows of the logarithm, however far the target is turned."""
    robot = arm(tmp_path, rows)
    kinematics = Kinematics(robot)
    kinematics.update(robot.q0)
    X = kinematics.placement(robot.frame_id)
    away = np.array([0.1, -0.05, 0.07])
    target = pin.SE3(X.rotation @ pin.exp3(np.array([1.0, -0.5, 0.3])), X.translation + away)
    task = PoseTask(gain=2.0).linearize(kinematics, target)
    wanted = away if rows.startswith("world") else X.rotation.T @ away
    np.testing.assert_allclose(task.V[:3], 2 * wanted, atol=1e-12)


def test_rows_of_a_pose_are_those_of_position_and_orientation(tmp_path: Path) -> None:
    """Three rows of either kind give the tasks of these names."""
    twist = pin.Motion(np.array([0.1, 0.2, -0.1, 0.3, 0.1, 0.2]))
    for rows, same in (("xyz", PositionTask), ("rxryrz", OrientationTask)):
        robot = arm(tmp_path, rows)
        kinematics = Kinematics(robot)
        kinematics.update(robot.q0 + 0.1)
        X = kinematics.placement(robot.frame_id)
        target = X * pin.exp6(pin.Motion(np.array([0.1, 0.0, 0.2, 0.4, -0.2, 0.1])))
        one, other = (task.linearize(kinematics, target, twist) for task in (PoseTask(), same()))
        np.testing.assert_allclose(one.V, other.V, atol=1e-12)
        np.testing.assert_allclose(one.J, other.J, atol=1e-12)


@pytest.mark.parametrize("rows", ["xyz", "xyzrxry", "world:xyrz"])
@pytest.mark.parametrize("law", ["pinv", "qp", "lp-alpha", "lp-alpha-components"])
def test_a_step_makes_the_wanted_rows_of_a_twist(law: str, rows: str, tmp_path: Path) -> None:
    """Whatever the others do; in the axes that were asked for."""
    robot = arm(tmp_path, rows)
    twist = np.array([0.02, 0.01, -0.03, 0.05, 0.02, -0.04])
    answer = dikbench.solve_dik(robot, robot.q0, twist=twist, formulation=law)
    kinematics = Kinematics(robot)
    kinematics.update(robot.q0)
    made = kinematics.jacobian(robot.frame_id) @ answer.velocity
    if rows.startswith("world"):
        R = kinematics.placement(robot.frame_id).rotation
        twist, made = (np.concatenate([R @ V[:3], R @ V[3:]]) for V in (twist, made))
    kept = list(robot.task_rows)
    # The quadratic program has a small cost on the velocity.
    np.testing.assert_allclose(made[kept], twist[kept], atol=1e-4)
    assert answer.progress == pytest.approx(1.0, abs=1e-3)


@pytest.mark.parametrize("rows", ["", "xx", "abc", "world:", "xyzw", "pose"])
def test_rows_that_are_none(rows: str, tmp_path: Path) -> None:
    """The message says how they are written."""
    with pytest.raises(DikbenchError, match=r"rows=.* is not valid; valid: x, y, z, rx, ry, rz"):
        arm(tmp_path, rows)


@pytest.mark.parametrize("rows", ["world:xyrz", "world:xy", "xyzrxry"])
def test_metrics_are_of_the_rows_that_are_asked_for(rows: str, tmp_path: Path) -> None:
    """Computed again from the trace they are the same; what drifts freely is no error."""
    path = write_arm(tmp_path, SIX)
    scenario = make_scenario(f"reach[robot={path},frame=tool,rows={rows},distance=0.05]")
    run = run_of("pinv", scenario)
    known = motion_of(run.trace, scenario, run.jacobians)
    again = motion_of(run.trace, scenario)
    np.testing.assert_array_equal(known.jacobians, again.jacobians)
    assert known.position_error[-1] < 1e-3
    if scenario.rows[-1] >= 3:
        assert known.orientation_error[-1] < 5e-3
        kinematics = Kinematics(scenario.robot)
        kinematics.update(run.trace.q[-1])
        R = kinematics.placement(scenario.robot.frame_id).rotation
        wanted = scenario.reference.placement(scenario.duration).rotation
        assert np.linalg.norm(pin.log3(R.T @ wanted)) > 0.02


@pytest.mark.parametrize("by_hand", ["velocity=0", "acceleration=0", "velocity=-1", "velocity=nan"])
def test_limits_by_hand_are_above_zero(by_hand: str, tmp_path: Path) -> None:
    """One line, before anything is divided by them."""
    path = write_arm(tmp_path, SIX)
    with pytest.raises(DikbenchError, match="is not valid; valid: a number above 0"):
        make_scenario(f"reach[robot={path},frame=tool,{by_hand}]")
