"""Tasks linearised at many configurations at once, against the tasks themselves."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pinocchio as pin
import pytest
from hypothesis import given
from hypothesis import strategies as st

from dikbench.problem.tasks import (
    DampingTask,
    OrientationTask,
    PoseTask,
    PositionTask,
    PostureTask,
)
from dikbench.problem.tasks.many_tasks import (
    ManyTargets,
    kind_of_task,
    kind_of_tracking,
    linearize_task,
    linearize_tracking,
    logarithms,
    rotation_vectors,
    row_of,
)
from dikbench.robots.kinematics import Kinematics
from dikbench.robots.loading import load_robot
from dikbench.robots.many_kinematics import ManyKinematics
from dikbench.robots.robot import Robot

ROWS = ("xyz", "rxryrz", "xyzrxryrz", "world:xyz", "world:xyzrxryrz", "world:xz")


def _targets(count: int, random: np.random.Generator, turn: float = 1.0) -> list[tuple[Any, Any]]:
    return [
        (
            pin.exp6(pin.Motion(np.r_[random.normal(size=3), turn * random.normal(size=3)])),
            pin.Motion(random.normal(size=6)),
        )
        for _ in range(count)
    ]


def _many(pairs: list[tuple[Any, Any]]) -> ManyTargets:
    return ManyTargets(
        np.array([X.rotation for X, _ in pairs]),
        np.array([X.translation for X, _ in pairs]),
        np.array([twist.vector for _, twist in pairs]),
    )


def _assert_as_alone(robot: Robot, task: Any, seed: int) -> None:
    random = np.random.default_rng(seed)
    q = np.array(
        [pin.integrate(robot.model, robot.q0, random.normal(size=robot.nv)) for _ in "abc"]
    )
    pairs = _targets(len(q), random)
    kinematics, alone = ManyKinematics(robot), Kinematics(robot)
    kinematics.update(q)
    many = linearize_tracking(task, robot, kinematics, _many(pairs))
    for row, (X, twist) in enumerate(pairs):
        alone.update(q[row])
        known = task.linearize(alone, X, twist)
        relative = alone.placement(robot.frame_id).actInv(X)
        made = row_of(many, row, task, robot, relative)
        assert type(made) is type(known)
        for part in ("J", "V", "error"):
            assert getattr(made, part) == pytest.approx(getattr(known, part), abs=1e-12)
        first, second = made.log_derivative, known.log_derivative
        assert (first is None) == (second is None)
        if first is not None and second is not None:
            assert first == pytest.approx(second, abs=1e-9)


@pytest.mark.parametrize("name", ["panda", "ur5", "planar3r", "tiago"])
@pytest.mark.parametrize("kind", [PoseTask, PositionTask, OrientationTask])
def test_tracking_tasks_are_those_of_each_row(name: str, kind: type[Any]) -> None:
    """Whole poses, in the plane, positions and orientations."""
    robot = load_robot(name)
    task = kind(gain=3.0, weight=2.0)
    assert kind_of_tracking(task, robot) is not None
    _assert_as_alone(robot, task, 1)


@pytest.mark.parametrize("rows", ROWS)
def test_chosen_rows_are_those_of_each_row(rows: str) -> None:
    """In the frame's axes and in the world's."""
    robot = load_robot("panda", rows=rows)
    task = PoseTask(gain=2.0)
    assert kind_of_tracking(task, robot) is not None
    _assert_as_alone(robot, task, 2)


@pytest.mark.parametrize("name", ["panda", "talos-humanoid"])
def test_decoupled_errors_are_those_of_each_row(name: str) -> None:
    """The other convention of a pose's error, which is a kind of its own."""
    robot, task = load_robot(name), PoseTask(gain=3.0, weight=2.0, convention="decoupled")
    assert kind_of_tracking(task, robot) != kind_of_tracking(PoseTask(gain=3.0, weight=2.0), robot)
    _assert_as_alone(robot, task, 3)


@pytest.mark.parametrize(
    "task", [PoseTask(frame="panda_link5"), PoseTask(weight=np.ones(6))], ids=["frame", "weights"]
)
def test_what_has_to_be_linearised_alone(task: Any) -> None:
    """Another frame, a weight per row; single turns."""
    assert kind_of_tracking(task, load_robot("panda")) is None
    assert kind_of_tracking(PoseTask(), load_robot("panda", rows="xyzrx")) is None


def test_tasks_of_different_kinds_are_not_one() -> None:
    """Another gain, weight, rows or axes is another kind."""
    robot, other = load_robot("panda"), load_robot("panda", rows="xyz")
    kinds = {
        kind_of_tracking(task, each)
        for task in (PoseTask(), PoseTask(gain=2.0), PoseTask(weight=3.0), PositionTask())
        for each in (robot, other)
    }
    assert len(kinds) == 8
    assert kind_of_task(PostureTask(robot.q0)) != kind_of_task(PostureTask(robot.q0, gain=2.0))
    assert kind_of_task(PostureTask(robot.q0, weight=np.ones(7))) is None


@pytest.mark.parametrize("name", ["panda", "talos-humanoid"])
def test_joint_tasks_are_those_of_each_row(name: str) -> None:
    """Postures, of free-flyers as well, and damping."""
    robot, random = load_robot(name), np.random.default_rng(0)
    q, postures = (
        np.array([pin.integrate(robot.model, robot.q0, random.normal(size=robot.nv)) for _ in "ab"])
        for _ in range(2)
    )
    alone = Kinematics(robot)
    for kind in (PostureTask(robot.q0, gain=2.0, weight=0.1), DampingTask(0.3)):
        many = linearize_task(kind, robot, q, postures)
        for row, posture in enumerate(postures):
            task = replace(kind, target=posture) if isinstance(kind, PostureTask) else kind
            alone.update(q[row])
            known = task.linearize(alone)
            made = row_of(many, row, task, robot, None)
            for part in ("J", "V", "error"):
                assert np.array_equal(getattr(made, part), getattr(known, part))
            assert (made.weight, made.priority) == (known.weight, known.priority)


@given(
    st.lists(st.floats(-2, 2), min_size=3, max_size=3),
    st.lists(st.floats(-1, 1), min_size=3, max_size=3).filter(lambda a: np.linalg.norm(a) > 1e-3),
    st.one_of(st.floats(0, np.pi - 1e-9), st.floats(-12, 0).map(lambda e: 10.0**e)),
)
def test_logarithms_give_the_placement_back(
    p: list[float], axis: list[float], angle: float
) -> None:
    """From the smallest turns to half a turn: exp6(log6(X)) = X."""
    X = pin.SE3(pin.exp3(angle * np.array(axis) / np.linalg.norm(axis)), np.array(p))
    logarithm = logarithms(X.rotation[None], X.translation[None])[0]
    back = pin.exp6(pin.Motion(logarithm))
    assert back.homogeneous == pytest.approx(X.homogeneous, abs=1e-9 if angle > 3.1 else 1e-12)
    turn = rotation_vectors(X.rotation[None])[0]
    assert float(np.linalg.norm(turn)) == pytest.approx(angle, abs=1e-7 if angle > 3.1 else 1e-12)
