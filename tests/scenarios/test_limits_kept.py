"""Paths near joint limits that can be done: `joint-limit-graze` and `joint-limit-detour`."""

from __future__ import annotations

import sys
from typing import get_args, get_type_hints

import numpy as np
import pinocchio as pin
import pytest
from makers.scenarios import metrics_of, put_robot

from dikbench.arrays import Array
from dikbench.errors import DikbenchError
from dikbench.plugins.building import make_scenario
from dikbench.robots.kinematics import Kinematics
from dikbench.robots.loading import load_robot
from dikbench.robots.robot import Robot
from dikbench.scenario import Scenario
from scenarios.joint_limit_crossing import CROSSINGS
from scenarios.joint_limit_detour import DETOURS, JointLimitDetour
from scenarios.joint_limit_graze import JointLimitGraze

GRAZES = [
    (robot, gap, speed, seed)
    for robot in CROSSINGS
    for gap, speed, seed in ((0.001, 0.8, 1), (0.01, 0.5, 0), (0.05, 0.2, 2))
]
WAYS = [
    (robot, approach, depth, seed)
    for robot in DETOURS
    for approach, depth, seed in ((0.03, 0.2, 1), (0.08, 0.12, 0), (0.15, 0.06, 2), (0.03, 0.06, 3))
]


def _margins(robot: Robot, q: Array) -> Array:
    """Compute the smallest distance to a position limit of each configuration (n, nq), (n,)."""
    limits = robot.limits
    assert limits.position is not None
    values = q[:, limits.q_index]
    room = np.minimum(limits.position.upper - values, values - limits.position.lower)
    margins: Array = np.where(limits.q_index >= 0, room, np.inf).min(axis=1)
    return margins


def _least_norm(scenario: Scenario, steps: int) -> Array:
    """Follow a path with the pseudo-inverse and a strong correction, (steps + 1, nq)."""
    robot, reference, q = scenario.robot, scenario.reference, [scenario.q0]
    kinematics = Kinematics(robot)
    for tau in np.linspace(0, reference.duration, steps + 1)[1:]:
        kinematics.update(q[-1])
        error = pin.log6(kinematics.placement(robot.frame_id).actInv(reference.placement(tau))).np
        q.append(q[-1] + np.linalg.pinv(kinematics.jacobian(robot.frame_id)) @ error)
    return np.array(q)


def test_there_are_enough_of_them() -> None:
    """At least 30 instances on at least four arms, each of which is tested below."""
    assert len(GRAZES) + len(WAYS) >= 30
    assert len(CROSSINGS) >= 4
    assert set(DETOURS) == set(get_args(get_type_hints(JointLimitDetour)["robot"]))
    assert set(CROSSINGS) == set(get_args(get_type_hints(JointLimitGraze)["robot"]))


@pytest.mark.parametrize(("robot", "gap", "speed", "seed"), GRAZES)
def test_a_graze_comes_as_near_as_it_says_and_keeps_every_limit(
    robot: str, gap: float, speed: float, seed: int
) -> None:
    """At its speed, by the clock; along the path, by the robot's own kinematics."""
    scenario = make_scenario(f"joint-limit-graze[robot={robot},gap={gap},speed={speed}]", seed)
    assert (scenario.feasible, scenario.situation) == ("time", "at joint limits")
    assert scenario.followable_until is None
    assert scenario.motion is not None
    margins = _margins(scenario.robot, scenario.motion.q)
    assert margins.min() == pytest.approx(gap, rel=1e-6)
    assert margins[0] == pytest.approx(0.4, rel=0.1)
    assert 0.9 * speed <= scenario.need <= 1.12 * speed
    nearest = scenario.motion.q[margins.argmin()]
    kinematics = Kinematics(scenario.robot)
    kinematics.update(nearest)
    middle = scenario.reference.placement(scenario.reference.duration / 2)
    placed = kinematics.placement(scenario.robot.frame_id)
    assert np.abs(pin.log6(middle.actInv(placed)).np).max() < 1e-9


@pytest.mark.parametrize(("robot", "approach", "depth", "seed"), WAYS)
def test_the_least_norm_motion_of_a_detour_is_outside_and_another_is_not(
    robot: str, approach: float, depth: float, seed: int
) -> None:
    """Both follow the path: one is deeper outside than nearly asked for, one keeps every limit."""
    name = f"joint-limit-detour[robot={robot},approach={approach},depth={depth}]"
    scenario = make_scenario(name, seed)
    assert (scenario.feasible, scenario.situation) == ("time", "at joint limits")
    assert scenario.motion is not None
    assert _margins(scenario.robot, scenario.motion.q).min() >= 0.9 * approach
    assert scenario.need <= 1
    least_norm = _least_norm(scenario, 400)
    deepest = _margins(scenario.robot, least_norm)
    assert -1.5 * depth < deepest.min() < -0.75 * depth
    position = scenario.robot.limits.position
    assert position is not None
    outside = np.maximum(least_norm - position.upper, position.lower - least_norm).max(axis=0)
    assert outside.argmax() == DETOURS[robot].joint


@pytest.mark.parametrize("robot", ["panda", "lwr"])
def test_limits_tell_formulations_apart_on_a_detour(robot: str) -> None:
    """The pseudo-inverse is outside; `qp` keeps the limit and the path, with the null space."""
    scenario = make_scenario(f"joint-limit-detour[robot={robot}]")
    blind, kept = (metrics_of(law, scenario) for law in ("pinv", "qp"))
    assert blind["position_violation_max_rad"] > 0.05
    assert kept["position_violation_max_rad"] < 1e-6
    assert kept["position_error_max_m"] < 5e-3


# --- blunted copies


def test_a_graze_of_another_joint_does_not_certify(monkeypatch: pytest.MonkeyPatch) -> None:
    """Another joint is nearer to its limit, or the arm is stretched, or the joint is slower."""
    arm = load_robot("ur5")
    assert arm.limits.position is not None
    upper = arm.limits.position.upper.copy()
    upper[2] = CROSSINGS["ur5"].posture[2] + 0.005
    put_robot(monkeypatch, arm.with_limits(position=(arm.limits.position.lower, upper)))
    with pytest.raises(
        DikbenchError, match=r"margin at the start.*smallest margin \[rad\] = 0.005"
    ):
        make_scenario("joint-limit-graze")
    monkeypatch.undo()
    module = sys.modules["scenarios.joint_limit_graze"]
    stretched = {"ur5": type(CROSSINGS["ur5"])((0.0, -1.2, 0.0, -1.7, -1.4, 0.2), 0)}
    monkeypatch.setattr(module, "CROSSINGS", stretched)
    with pytest.raises(DikbenchError, match="smallest singular value"):
        make_scenario("joint-limit-graze")
    monkeypatch.undo()
    slow = module.there_and_back
    monkeypatch.setattr(module, "there_and_back", lambda *a: slow(*a[:3], 2 * a[3]))
    with pytest.raises(DikbenchError, match="required speed over limit"):
        make_scenario("joint-limit-graze")


def test_a_detour_that_is_none_does_not_certify(monkeypatch: pytest.MonkeyPatch) -> None:
    """The joint alone; too short a way; too slow; a posture near a singularity."""
    module = sys.modules["scenarios.joint_limit_detour"]
    monkeypatch.setattr(module, "_instead_of", lambda robot, q, joint: np.eye(robot.nv)[joint])
    with pytest.raises(DikbenchError, match=r"position margin \[rad\]"):
        make_scenario("joint-limit-detour")
    monkeypatch.undo()
    length = module._length
    monkeypatch.setattr(module, "_length", lambda *a: 0.5 * length(*a))
    with pytest.raises(DikbenchError, match="margin of the least-norm motion"):
        make_scenario("joint-limit-detour")
    monkeypatch.undo()
    stretched = (2.82, -0.26, 0.58, -0.5, 0.62, 1.85, 0.88)
    monkeypatch.setattr(module, "DETOURS", {"panda": type(DETOURS["panda"])(stretched, 0, 1)})
    pattern = r"its smallest singular value.*; smallest singular value"
    with pytest.raises(DikbenchError, match=pattern):
        make_scenario("joint-limit-detour")
    monkeypatch.undo()
    slow = module.there_and_back
    monkeypatch.setattr(module, "there_and_back", lambda *a: slow(*a[:3], 2 * a[3]))
    with pytest.raises(DikbenchError, match="required speed over limit"):
        make_scenario("joint-limit-detour")


def test_a_joint_that_the_null_space_does_not_move_has_no_detour(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """The least-norm motion does not get there: an error that says so."""
    module = sys.modules["scenarios.joint_limit_detour"]
    monkeypatch.setattr(module, "LONGEST_WAY_RAD", 0.1)
    with pytest.raises(DikbenchError, match="the least-norm motion keeps joint 1 inside"):
        make_scenario("joint-limit-detour")
