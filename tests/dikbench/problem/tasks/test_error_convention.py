"""The two conventions of a pose's error: finite differences, and where they are the same."""

from __future__ import annotations

from typing import Any

import numpy as np
import pinocchio as pin
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from dikbench.arrays import Array
from dikbench.errors import DikbenchError
from dikbench.problem.tasks import OrientationTask, PoseTask, PositionTask
from dikbench.problem.tasks.pose import ErrorConvention
from dikbench.robots.kinematics import Kinematics
from dikbench.robots.loading import load_robot
from dikbench.robots.robot import Robot

STEP = 1e-6
BOTH: tuple[ErrorConvention, ...] = ("log6", "decoupled")
ROBOTS = ("panda", "ur5", "talos-humanoid")


def _at(robot: Robot, q: Array) -> Kinematics:
    kinematics = Kinematics(robot)
    kinematics.update(q)
    return kinematics


def _near(robot: Robot, random: np.random.Generator, spread: float) -> Array:
    q: Array = pin.integrate(robot.model, robot.q0, random.uniform(-spread, spread, robot.nv))
    return q


def _target(robot: Robot, q: Array) -> Any:
    return _at(robot, q).placement(robot.frame_id).copy()


@pytest.mark.parametrize("name", ROBOTS)
@pytest.mark.parametrize("convention", BOTH)
@settings(deadline=None, max_examples=15)
@given(seed=st.integers(0, 2**32 - 1))
def test_jacobian_is_the_derivative_of_the_error(
    name: str, convention: ErrorConvention, seed: int
) -> None:
    """-Jl J v is the rate of the error, by central differences.

    The decoupled one is differentiated in the axes of the world, as its docstring says.
    """
    robot, random = load_robot(name), np.random.default_rng(seed)
    q, v = _near(robot, random, 1.0), random.normal(size=robot.nv)
    task = PoseTask(target=_target(robot, _near(robot, random, 0.4)), convention=convention)
    here = task.linearize(_at(robot, q))

    def seen(sign: int) -> Array:
        kinematics = _at(robot, pin.integrate(robot.model, q, sign * STEP * v))
        error = task.linearize(kinematics).error
        if convention == "log6":
            return error
        R = kinematics.placement(robot.frame_id).rotation
        return np.concatenate([R @ error[:3], error[3:]])

    rate = (seen(1) - seen(-1)) / (2 * STEP)
    if convention == "decoupled":
        rate[:3] = _at(robot, q).placement(robot.frame_id).rotation.T @ rate[:3]
    assert here.log_derivative is not None
    assert -here.log_derivative @ here.J @ v == pytest.approx(rate, abs=1e-4)
    assert here.log_derivative @ here.error == pytest.approx(here.error)


@pytest.mark.parametrize("name", ROBOTS)
def test_decoupled_is_the_position_task_above_the_orientation_task(name: str) -> None:
    """Errors, feed-forward and Jacobian are those of the two tasks."""
    robot, random = load_robot(name), np.random.default_rng(4)
    kinematics = _at(robot, _near(robot, random, 0.5))
    target = _target(robot, _near(robot, random, 0.5))
    twist = pin.Motion(random.normal(size=6))
    whole = PoseTask(gain=3.0, convention="decoupled").linearize(kinematics, target, twist)
    halves = [
        kind(gain=3.0).linearize(kinematics, target, twist)
        for kind in (PositionTask, OrientationTask)
    ]
    for part in ("J", "V", "error"):
        stacked = np.concatenate([getattr(half, part) for half in halves])
        assert getattr(whole, part) == pytest.approx(stacked, abs=1e-14)


def test_conventions_agree_without_a_turn_and_part_with_one() -> None:
    """The logarithm of a translation is the translation; a turn bends the screw."""
    robot = load_robot("panda")
    kinematics = _at(robot, robot.q0)
    X = kinematics.placement(robot.frame_id).copy()
    shift = pin.SE3(np.eye(3), np.array([0.1, -0.2, 0.05]))
    turn = pin.SE3(pin.exp3(np.array([0.0, 0.8, 0.0])), np.array([0.1, -0.2, 0.05]))
    errors = {
        (convention, move): PoseTask(target=X * move, convention=convention)
        .linearize(kinematics)
        .error
        for convention in BOTH
        for move in (shift, turn)
    }
    assert errors["log6", shift] == pytest.approx(errors["decoupled", shift])
    assert errors["decoupled", turn][:3] == pytest.approx(turn.translation)
    apart = errors["log6", turn] - errors["decoupled", turn]
    assert np.linalg.norm(apart[:3]) > 0.04  # half of the turn times the distance across it
    assert apart[3:] == pytest.approx(np.zeros(3), abs=1e-12)


def test_an_unknown_convention_is_refused() -> None:
    """The message lists those that there are."""
    wrong: Any = "log3"
    with pytest.raises(DikbenchError, match=r"convention 'log3'.*valid: decoupled, log6"):
        PoseTask(convention=wrong)
