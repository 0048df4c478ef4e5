"""Configurations whose (cos, sin) or quaternions have not norm 1, and targets that are none."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
import pinocchio as pin
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from makers.scenarios import planar_scenario

from dikbench import DikbenchError, load_robot, solve_dik
from dikbench.arrays import Array
from dikbench.problem import (
    DikProblem,
    LinearizedTask,
    OrientationTask,
    PoseTask,
    PositionTask,
    PostureTask,
    Robot,
)
from dikbench.robots.kinematics import Kinematics
from dikbench.robots.robot import model_limits
from dikbench.scenario import joint_path

TWIST = np.array([0.1, 0, 0, 0, 0, 0])


def _ball_and_wheels() -> Robot:
    """A planar joint, a ball joint and a wheel, one after the other."""
    model, joint = pin.Model(), 0
    for name, kind in (
        ("wheels", pin.JointModelPlanar()),
        ("ball", pin.JointModelSpherical()),
        ("turn", pin.JointModelRUBX()),
    ):
        joint = model.addJoint(joint, kind, pin.SE3.Identity(), name)
    model.addFrame(pin.Frame("tip", joint, pin.SE3.Identity(), pin.FrameType.OP_FRAME))
    return Robot("ball", model, "tip", model_limits(model), pin.neutral(model))


ROBOTS = {
    "kinova": load_robot("kinova"),
    "talos-humanoid": load_robot("talos-humanoid"),
    "ball": _ball_and_wheels(),
}


def _ask(robot: Robot, q: Array) -> Any:
    return solve_dik(robot, q, twist=TWIST, formulation="dls")


def _problem(robot: Robot, q: Array) -> DikProblem:
    task = LinearizedTask(np.eye(robot.nv), np.zeros(robot.nv), np.zeros(robot.nv))
    return DikProblem(robot, q, None, 0.01, [task], robot.limits.at(q))


WAYS: dict[str, Callable[[Robot, Array], Any]] = {
    "solve_dik": _ask,
    "robot": lambda robot, q: replace(robot, q0=q),
    "posture": lambda robot, q: PostureTask(q).linearize(Kinematics(robot)),
    "problem": _problem,
    "scenario": lambda robot, q: replace(planar_scenario(), robot=robot, q0=q),
}
"""All ways of a configuration into the harness."""


@pytest.mark.parametrize("way", WAYS)
@settings(deadline=None, max_examples=25)
@given(data=st.data())
def test_a_configuration_off_the_unit_norm_is_refused_and_names_the_joint(
    way: str, data: st.DataObject
) -> None:
    """Whatever joint it is, however its unit part is scaled, and whichever way it comes."""
    robot = ROBOTS[data.draw(st.sampled_from(sorted(ROBOTS)))]
    model = robot.model
    joints = [k for k, joint in enumerate(model.joints) if joint.nq > joint.nv]
    k = data.draw(st.sampled_from(joints))
    scale = data.draw(st.one_of(st.floats(-0.9, 0.99), st.floats(1.01, 10.0)))
    v = np.random.default_rng(data.draw(st.integers(0, 99))).normal(size=robot.nv)
    q = pin.integrate(model, robot.q0, v)
    WAYS[way](robot, q)
    joint = model.joints[k]
    unit = 2 if "Planar" in joint.shortname() or joint.nq == 2 else 4
    q[joint.idx_q + joint.nq - unit : joint.idx_q + joint.nq] *= scale
    with pytest.raises(DikbenchError, match=rf"'{model.names[k]}'.* norm must be 1") as raised:
        WAYS[way](robot, q)
    assert "\n" not in str(raised.value)


def test_the_start_of_load_robot_is_checked_alike() -> None:
    """It is a configuration that came from outside."""
    kinova = ROBOTS["kinova"]
    with pytest.raises(DikbenchError, match=r"robot kinova: start: .*j2s6s200_joint_1"):
        load_robot("kinova", start=np.where(np.arange(9) < 2, 0.0, kinova.q0))


def test_rounded_digits_are_brought_to_norm_one() -> None:
    """As those of pose files are: the same answer as from the exact coordinates."""
    kinova = ROBOTS["kinova"]
    q, rounded = kinova.q0.copy(), kinova.q0.copy()
    q[:2], rounded[:2] = [np.sqrt(0.5), np.sqrt(0.5)], [0.7071, 0.7071]
    np.testing.assert_allclose(_ask(kinova, rounded).velocity, _ask(kinova, q).velocity, atol=1e-12)


NO_ROTATIONS: dict[str, Callable[[Array], Array]] = {
    "scaled": lambda R: 1.01 * R,
    "mirrored": lambda R: R @ np.diag([1.0, 1, -1]),
    "point mirrored": lambda R: -R,
    "sheared": lambda R: R @ np.array([[1, 1e-3, 0], [0, 1, 0], [0, 0, 1]]),
    "third row": lambda R: np.diag([1, 1, 1.01]) @ R,
    "noisy": lambda R: R + 1e-3 * np.arange(9).reshape(3, 3),
    "nothing": lambda R: 0.0 * R,
}
TARGETS: dict[str, Callable[[Robot, Kinematics, Any], Any]] = {
    "solve_dik": lambda robot, at, X: solve_dik(robot, at.q, target=X, formulation="pinv"),
    "pose": lambda robot, at, X: PoseTask().linearize(at, X),
    "orientation": lambda robot, at, X: OrientationTask(target=X.rotation).linearize(at),
    "moving point": lambda robot, at, X: PositionTask().linearize(at, X, pin.Motion(TWIST)),
}


@pytest.mark.parametrize("way", TARGETS)
@settings(deadline=None, max_examples=10)
@given(seed=st.integers(0, 2**32 - 1), rounded=st.booleans())
def test_a_target_that_is_no_rotation_is_refused(way: str, seed: int, rounded: bool) -> None:
    """Wherever it comes from; any rotation is taken, in single precision too."""
    robot, at = load_robot("panda"), Kinematics(load_robot("panda"))
    at.update(robot.q0)
    R = pin.Quaternion(np.random.default_rng(seed).normal(size=4)).normalized().matrix()
    if rounded:
        R = R.astype(np.float32).astype(float)
    X = at.placement(robot.frame_id).copy()
    TARGETS[way](robot, at, pin.SE3(R, X.translation))
    for spoil in NO_ROTATIONS.values():
        with pytest.raises(DikbenchError, match=r"target: .*is not a rotation") as raised:
            TARGETS[way](robot, at, pin.SE3(spoil(R), X.translation))
        assert "\n" not in str(raised.value)


@pytest.mark.parametrize("until", [0.0, 0.5, 1.0])
def test_a_reference_that_is_no_placement_is_refused(until: float) -> None:
    """A family's author may compute one that grows or shrinks on its way."""
    fine = planar_scenario()
    robot, end = fine.robot, fine.reference.duration
    path = joint_path(robot, lambda tau: fine.q0, lambda tau: np.zeros(3), end)

    def spoilt(tau: float) -> Any:
        X = path.placement(tau)
        return X if tau != until * end else pin.SE3(1.1 * X.rotation, X.translation)

    with pytest.raises(DikbenchError, match=r"scenario: target: .*is not a rotation"):
        replace(fine, reference=replace(path, placement=spoilt))
