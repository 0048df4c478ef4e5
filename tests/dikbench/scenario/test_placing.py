"""Configurations for placements: several motions in the same steps."""

from __future__ import annotations

import numpy as np
import pinocchio as pin
import pytest
from numpy.testing import assert_array_equal
from scipy.linalg import svdvals

from dikbench.errors import DikbenchError
from dikbench.problem.tasks import PoseTask
from dikbench.robots.kinematics import Kinematics, along, differences, moved, placements
from dikbench.robots.loading import load_robot
from dikbench.robots.robot import Robot
from dikbench.scenario.oracle import measure_motion
from dikbench.scenario.placing import Pursuit, pursue

ROBOTS = ("panda", "tiago", "kinova", "planar3r", "base")


def drawn(robot: Robot, count: int) -> np.ndarray:
    """Draw configurations about the robot's start, (count, nq)."""
    random = np.random.default_rng(count)
    return moved(robot, np.array([robot.q0] * count), 0.3 * random.normal(size=(count, robot.nv)))


def to(robot: Robot, twist: list[float]) -> Pursuit:
    """Ask for a placement beside the robot's start."""
    kinematics = Kinematics(robot)
    kinematics.update(robot.q0)
    start = kinematics.placement(robot.frame_id).copy()
    targets = [start * pin.exp6(pin.Motion(share * np.array(twist))) for share in (0.5, 1.0)]
    return Pursuit(robot, PoseTask(), targets, robot.q0, 30)


@pytest.mark.parametrize("name", ROBOTS)
def test_quantities_along_a_motion_are_those_of_each_configuration(name: str) -> None:
    """By Pinocchio, one by one; of joints that turn, slide and have no end."""
    robot = load_robot(name)
    q = drawn(robot, 4)
    rows = list(robot.task_rows)
    jacobians, placed = along(robot, q)
    assert_array_equal(placed, placements(robot, robot.frame_id, q))
    for k, each in enumerate(q):
        J = pin.computeFrameJacobian(
            robot.model, robot.model.createData(), each, robot.frame_id, pin.LOCAL
        )
        assert np.abs(jacobians[k] - J[rows]).max() < 1e-14
    steps = differences(robot, q)
    expected = [pin.difference(robot.model, q[k], q[k + 1]) for k in range(3)]
    assert_array_equal(steps, expected)
    again = [pin.integrate(robot.model, q[k], steps[k]) for k in range(3)]
    assert_array_equal(moved(robot, q[:-1], steps), again)


def test_rows_in_the_worlds_axes_are_those_of_the_turned_frame() -> None:
    """J of the world's axes at the frame, by Pinocchio."""
    robot = load_robot("panda", rows="world:xyrz")
    q = drawn(robot, 3)
    jacobians, _ = along(robot, q)
    aligned = pin.ReferenceFrame.LOCAL_WORLD_ALIGNED
    for k, each in enumerate(q):
        data = robot.model.createData()
        J = pin.computeFrameJacobian(robot.model, data, each, robot.frame_id, aligned)
        assert np.abs(jacobians[k] - J[[0, 1, 5]]).max() < 1e-14


@pytest.mark.parametrize("name", ["panda", "planar3r", "ur5"])
def test_the_smallest_singular_value_is_exact_however_small(name: str) -> None:
    """From regular postures to singular ones, where eigenvalues would be rounding."""
    robot = load_robot(name)
    ends = [robot.q0, np.zeros(robot.nq)]  # stretched, or folded
    q = np.array([(1 - s) * ends[0] + s * ends[1] for s in (0, 0.5, 0.9, 1 - 1e-4, 1 - 1e-9, 1)])
    measured = measure_motion(robot, np.arange(len(q), dtype=float), q).sigma_min
    expected = [svdvals(J)[-1] for J in along(robot, q)[0]]
    assert measured == pytest.approx(expected, abs=2e-14)


@pytest.mark.parametrize("name", ["panda", "base", "kinova", "planar3r"])
def test_what_cannot_be_reached_costs_the_others_nothing(name: str) -> None:
    """The same bits as by itself; a failure says what is left."""
    robot = load_robot(name)
    twists = [[0.02, 0.01, 0, 0, 0, 0.1], [50.0, 0, 0, 0, 0, 0], [0, 0.02, 0, 0, 0, -0.1]]
    alone, together = ([to(robot, twist) for twist in twists] for _ in range(2))
    for each in (alone[1], together[1]):
        each.targets = [*list(each.targets)[:1], "nowhere"]
    for each in alone:
        pursue([each])
    pursue(together)
    for one, other in zip(alone, together, strict=True):
        assert str(one.failure) == str(other.failure)
        assert_array_equal(one.found, other.found)
    assert [each.failure is None for each in together] == [True, False, True]
    for each in (together[0], together[2]):
        for q, target in zip(each.found, each.targets, strict=True):
            there = pin.SE3(placements(robot, robot.frame_id, q[None])[0])
            assert np.abs(pin.log6(there.actInv(target)).np).max() < 1e-9


def test_a_matrix_that_cannot_be_inverted_costs_its_own_motion_only(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """LAPACK refuses all of a stack for one of them: they are asked again one by one."""
    robot = load_robot("ur5")
    pursuits = [to(robot, [0.01 * k, 0.02, 0, 0, 0, 0]) for k in range(4)]
    solve, bad = np.linalg.solve, pursuits[2]

    def refuses(M: np.ndarray, e: np.ndarray) -> np.ndarray:
        first = next(iter(bad.targets))
        kinematics = Kinematics(robot)
        kinematics.update(robot.q0)
        error = pin.log6(kinematics.placement(robot.frame_id).actInv(first)).np
        if (e[..., 0] == error).all(axis=1).any():
            raise np.linalg.LinAlgError("Singular matrix")
        return np.asarray(solve(M, e))

    expected = [to(robot, [0.01 * k, 0.02, 0, 0, 0, 0]) for k in range(4)]
    pursue(expected)
    monkeypatch.setattr(np.linalg, "solve", refuses)
    pursue(pursuits)
    for k, (one, other) in enumerate(zip(pursuits, expected, strict=True)):
        if k == 2:
            assert isinstance(one.failure, np.linalg.LinAlgError)
        else:
            assert one.failure is None
            assert_array_equal(one.found, other.found)


def test_a_target_that_is_no_placement_is_an_error() -> None:
    """In the words of the task."""
    pursuit = to(load_robot("panda"), [0.0] * 6)
    pursuit.targets = [np.eye(4)]
    pursue([pursuit])
    assert isinstance(pursuit.failure, DikbenchError)
    assert "expected a pinocchio.SE3" in str(pursuit.failure)
