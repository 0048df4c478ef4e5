"""Kinematics of many configurations at once: Pinocchio's, whatever the joints, row by row."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pinocchio as pin
import pytest

from dikbench.arrays import Array
from dikbench.robots.catalogue import ROBOTS
from dikbench.robots.kinematics import Kinematics
from dikbench.robots.loading import load_robot
from dikbench.robots.many_kinematics import ManyKinematics
from dikbench.robots.robot import Robot

ONE_DEGREE_OF_FREEDOM = (
    pin.JointModelRX, pin.JointModelRY, pin.JointModelRZ, pin.JointModelPX, pin.JointModelPY,
    pin.JointModelPZ, pin.JointModelRUBX, pin.JointModelRUBY, pin.JointModelRUBZ,
)  # fmt: skip


def _random(robot: Robot, count: int, seed: int = 0) -> Array:
    random = np.random.default_rng(seed)
    steps = random.uniform(-2, 2, (count, robot.nv))
    return np.array([pin.integrate(robot.model, robot.q0, step) for step in steps])


def _assert_equal(robot: Robot, q: Array, tolerance: float) -> None:
    many, alone = ManyKinematics(robot), Kinematics(robot)
    many.update(q)
    for row, configuration in enumerate(q):
        alone.update(configuration)
        X = alone.placement(robot.frame_id)
        assert many.rotations[row] == pytest.approx(X.rotation, abs=tolerance)
        assert many.translations[row] == pytest.approx(X.translation, abs=tolerance)
        J = alone.jacobian(robot.frame_id)
        assert many.jacobians[row] == pytest.approx(J, abs=tolerance)


@pytest.mark.parametrize("name", ROBOTS)
def test_every_robot_moves_as_alone(name: str) -> None:
    """To rounding; free-flyers and planar joints as well."""
    robot = load_robot(name)
    _assert_equal(robot, _random(robot, 20), 1e-14)


@pytest.mark.parametrize("seed", range(12))
def test_trees_of_all_joints_of_one_degree_of_freedom(seed: int) -> None:
    """Random placements and axes, with a limb aside that does not move the frame."""
    random = np.random.default_rng(seed)
    model, parent = pin.Model(), 0
    for number in range(9):
        unaligned = number % 4 == 3
        axis = random.normal(size=3)
        axis /= np.linalg.norm(axis)
        kind = (
            random.choice([pin.JointModelRevoluteUnaligned, pin.JointModelPrismaticUnaligned])(axis)
            if unaligned
            else random.choice(ONE_DEGREE_OF_FREEDOM)()
        )
        index = model.addJoint(parent, kind, pin.SE3.Random(), f"joint{number}")
        parent = parent if number == 5 else index
    model.addFrame(pin.Frame("tool", parent, pin.SE3.Random(), pin.FrameType.OP_FRAME))
    known = load_robot("panda")
    neutral = pin.neutral(model)
    limits = known.limits.of_joints(np.zeros(0, dtype=int), np.zeros(0, dtype=int))
    robot = replace(known, name="tree", model=model, frame="tool", q0=neutral, limits=limits)
    _assert_equal(robot, _random(robot, 10, seed), 1e-12)


@pytest.mark.parametrize("name", ["panda", "ur5", "tiago", "talos-humanoid"])
def test_a_row_does_not_know_the_others(name: str) -> None:
    """To the bit: in another order, in a part, alone."""
    robot = load_robot(name)
    q = _random(robot, 40)
    whole = ManyKinematics(robot)
    whole.update(q)
    for rows in (np.arange(40)[::-1], np.arange(0, 40, 7), np.array([17])):
        part = ManyKinematics(robot)
        part.update(q[rows])
        for name_of_part in ("rotations", "translations", "jacobians"):
            assert np.array_equal(getattr(part, name_of_part), getattr(whole, name_of_part)[rows])
