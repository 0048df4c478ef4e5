"""The gradient of the manipulability where joints have several velocities, and who may use it."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
import pinocchio as pin
import pytest
from makers.problems import kinematics_at, velocity_of

from dikbench import DikbenchError, PositionTask, Robot, load_robot, solve_dik
from dikbench.problem.posing import pose_problem
from dikbench.robots.robot import model_limits
from formulations.manipulability import (
    columns_before,
    manipulability_gradient,
)
from formulations.manipulability_gradients import manipulability_gradients

RX, RY, RZ = pin.JointModelRX, pin.JointModelRY, pin.JointModelRZ
PX, PY, PZ = pin.JointModelPX, pin.JointModelPY, pin.JointModelPZ
STEP = 1e-6
TWIST = (0.1, 0, 0, 0, 0, 0)


def _chain(*joints: Any) -> Robot:
    """Joints one after the other, of seeded placements; the first three stand where they are."""
    model, last, random = pin.Model(), 0, np.random.default_rng(5)
    for number, joint in enumerate(joints):
        offset = pin.SE3(np.eye(3), random.normal(size=3)) if number > 2 else pin.SE3.Identity()
        last = model.addJoint(last, joint, offset, f"joint{number}")
    tip = pin.Frame("tip", last, pin.SE3.Random(), pin.FrameType.OP_FRAME)
    model.addFrame(tip)
    return Robot("chain", model, "tip", model_limits(model), pin.neutral(model))


CHAINS = {
    "humanoid": load_robot("talos-humanoid"),
    "free-flyer in the middle": _chain(RZ(), RX(), pin.JointModelFreeFlyer(), RY(), RX()),
    "wheels and a ball": _chain(pin.JointModelPlanar(), RZ(), pin.JointModelSpherical(), RX()),
    "translation": _chain(RX(), pin.JointModelTranslation(), RY(), RZ(), pin.JointModelRUBX()),
    "six joints like a free-flyer": _chain(PX(), PY(), PZ(), RX(), RY(), RZ(), RX(), RY()),
}


def _by_differences(robot: Robot, q: Any) -> Sequence[float]:
    model, data = robot.model, robot.model.createData()

    def manipulability(v: Any) -> float:
        moved = pin.integrate(model, q, v)
        J = pin.computeFrameJacobian(model, data, moved, robot.frame_id, pin.LOCAL)
        return float(np.sqrt(np.linalg.det(J @ J.T)))

    steps = STEP * np.eye(robot.nv)
    return [(manipulability(v) - manipulability(-v)) / (2 * STEP) for v in steps]


@pytest.mark.parametrize("name", CHAINS)
@pytest.mark.parametrize("spread", [0.0, 0.4])
def test_the_gradient_is_the_derivative_on_the_manifold(name: str, spread: float) -> None:
    """By central differences along the tangent, at the neutral configuration and away from it."""
    robot = CHAINS[name]
    v = spread * np.random.default_rng(1).normal(size=robot.nv)
    q = pin.integrate(robot.model, robot.q0, v)
    J = pin.computeFrameJacobian(
        robot.model, robot.model.createData(), q, robot.frame_id, pin.LOCAL
    )
    expected = np.array(_by_differences(robot, q))
    tolerance = 1e-6 * np.abs(expected).max()
    assert np.abs(expected).max() > 1e-3
    found = manipulability_gradient(J, columns_before(robot))
    assert found == pytest.approx(expected, abs=tolerance)
    if name == "humanoid":
        assert np.array_equal(found[:6], np.zeros(6))
        assert np.array_equal(found, manipulability_gradient(J))


@pytest.mark.parametrize("robot", [*CHAINS.values(), load_robot("panda"), load_robot("planar4r")])
def test_the_gradients_of_many_are_those_of_each(robot: Robot) -> None:
    """Of chains, free-flyers and planar arms; zero where the Jacobian has no rank."""
    random = np.random.default_rng(2)
    rows = list(robot.task_rows)
    jacobians = [np.zeros((len(rows), robot.nv))]
    for _ in range(4):
        q = pin.integrate(robot.model, robot.q0, 0.5 * random.normal(size=robot.nv))
        jacobians.append(kinematics_at(robot, q).jacobian(robot.frame_id)[rows])
    before = columns_before(robot)
    expected = np.array([manipulability_gradient(J, before) for J in jacobians])
    assert np.abs(expected).max() > 1e-3
    found = manipulability_gradients(np.array(jacobians), before)
    assert found == pytest.approx(expected, abs=1e-9 * np.abs(expected).max())


@pytest.mark.parametrize(
    "joint", [pin.JointModelSphericalZYX(), pin.JointModelUniversal(1, 0, 0, 0, 1, 0)]
)
def test_a_joint_whose_own_axes_move_is_refused(joint: Any) -> None:
    """Where the gradient is wanted: the message says how to do without."""
    robot = _chain(RX(), joint, RY(), RZ(), RX(), RY(), RZ())
    with pytest.raises(DikbenchError, match="Neo: the axes of joint 'joint1' move") as raised:
        solve_dik(robot, robot.q0, twist=TWIST, formulation="neo")
    assert "manipulability_gain=0" in str(raised.value)
    solve_dik(robot, robot.q0, twist=TWIST, formulation="neo[manipulability_gain=0]")


def test_six_rows_that_are_no_pose_have_no_reward() -> None:
    """Two points of three rows each, together of the first priority, have no manipulability."""
    robot = load_robot("panda")
    elbow = PositionTask(target=np.array([0.1, 0.0, 0.6]), frame="panda_link4")
    hand = PositionTask(target=np.array([0.4, 0.0, 0.5]))
    kinematics = kinematics_at(robot, robot.q0)
    problem = pose_problem(kinematics, None, 0.01, hand.linearize(kinematics), [elbow])
    assert len(problem.primary.V) == len(robot.task_rows)
    with_it = velocity_of("neo", problem)
    np.testing.assert_array_equal(with_it, velocity_of("neo[manipulability_gain=0]", problem))
