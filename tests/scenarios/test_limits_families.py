"""Approaches to limits, starts outside them, and a goal behind one: what they claim and provoke."""

from __future__ import annotations

import itertools
import sys
from math import pi

import numpy as np
import pinocchio as pin
import pytest
from makers.scenarios import metrics_of, run_of, scenario_error

from dikbench.errors import DikbenchError
from dikbench.metrics import evaluate, motion_of
from dikbench.parameters import Range
from dikbench.plugins.building import make_plant, make_scenario
from dikbench.robots.kinematics import Kinematics
from dikbench.robots.loading import load_robot
from dikbench.scenario import joint_oracle
from dikbench.simulation.closed_loop import simulate
from dikbench.simulation.oracle_formulation import OracleFormulation
from dikbench.solvers.checked_solve import make_solve
from scenarios.joint_limit_crossing import CROSSINGS, Crossing
from scenarios.start_outside import JOINTS

# --- crossing


@pytest.mark.parametrize("robot", CROSSINGS)
def test_laws_without_limits_cross_and_those_with_them_do_not(robot: str) -> None:
    """The pseudo-inverse goes as deep as the path, clipped or scaled too; the program stays."""
    scenario = make_scenario(f"joint-limit-crossing[robot={robot}]")
    for law in ("pinv", "pinv[after=clip]", "pinv[after=scale]"):
        assert metrics_of(law, scenario)["position_violation_max_rad"] > 0.19
    assert metrics_of("qp", scenario)["position_violation_max_rad"] < 1e-4


@pytest.mark.parametrize(("robot", "joint"), [("tiago", 4), ("panda", 0)])
def test_a_joint_that_the_null_space_spares_does_not_certify(
    monkeypatch: pytest.MonkeyPatch, robot: str, joint: int
) -> None:
    """TIAGo's joint 5 and the Panda's base: most of their motion is left to the others."""
    module = sys.modules["scenarios.joint_limit_crossing"]
    spared = Crossing(tuple(load_robot(robot).q0), joint)
    monkeypatch.setattr(module, "CROSSINGS", {robot: spared})
    with pytest.raises(DikbenchError, match="its share in the least-norm motion"):
        make_scenario(f"joint-limit-crossing[robot={robot}]")


# --- approach at speed

SEVEN_JOINTS = ("panda", "xarm7", "tiago", "lwr")


@pytest.mark.parametrize("joint", ["pan", "wrist_3"])
@pytest.mark.parametrize(
    ("robot", "deceleration"),
    [
        *itertools.product(("ur3", "ur5", "ur10"), (2.0, 5.0, 20.0)),
        *((robot, 2.0) for robot in SEVEN_JOINTS),
    ],
)
def test_an_approach_leaves_room_to_brake_and_no_more(
    robot: str, joint: str, deceleration: float
) -> None:
    """1.25 braking distances v^2/(2 a), at 0.9 of the joint's speed, to `depth` beyond or more.

    It lasts until a joint that keeps its speed for as long as it can, and then brakes, has stopped.
    """
    scenario = make_scenario(
        f"joint-limit-approach[robot={robot},joint={joint},deceleration={deceleration}]"
    )
    arm = scenario.robot
    j = {"pan": 0, "wrist_3": arm.nv - 1}[joint]
    position, velocity, acceleration = (
        arm.limits.position,
        arm.limits.velocity,
        arm.limits.acceleration,
    )
    assert position is not None
    assert velocity is not None
    assert acceleration is not None
    assert np.all(acceleration.upper == deceleration)
    assert scenario.v0[j] == pytest.approx(0.9 * velocity.upper[j])
    room = position.upper[j] - scenario.q0[j]
    braking = scenario.v0[j] ** 2 / (2 * deceleration)
    assert room == pytest.approx(max(1.25 * braking, 0.3))
    end = scenario.q0 + scenario.reference.duration * scenario.v0
    assert 0.2 - 1e-9 < end[j] - position.upper[j] < 3.0
    stopping = (room - braking) / scenario.v0[j] + scenario.v0[j] / deceleration
    assert scenario.reference.duration > stopping
    assert np.count_nonzero(scenario.v0) == 1


@pytest.mark.parametrize("deceleration", [2.0, 5.0, 20.0])
def test_looking_one_step_ahead_brakes_too_late(deceleration: float) -> None:
    """`one-step` gives the acceleration limit up, `viable` keeps both, `pinv` runs through.

    `sqrt` stops, but its box is empty on most of the steps, and it brakes up to twice as hard.
    """
    scenario = make_scenario(f"joint-limit-approach[deceleration={deceleration}]")
    hasty, viable, sqrt, blind = (
        metrics_of(law, scenario)
        for law in ("qp[braking=one-step]", "qp", "lp-alpha[braking=sqrt]", "pinv")
    )
    assert sqrt["position_violation_max_rad"] < 1e-6
    assert 0.3 < sqrt["acceleration_violation_max_rad_s2"] / deceleration < 1.0
    moving = round(scenario.reference.duration / scenario.dt)  # then the target is at rest
    assert 0.6 < run_of("lp-alpha[braking=sqrt]", scenario).trace.relaxed[:moving].mean() < 0.9
    assert hasty["position_violation_max_rad"] < 1e-6
    assert hasty["acceleration_violation_max_rad_s2"] > 5 * deceleration
    assert viable["position_violation_max_rad"] < 1e-6
    assert viable["acceleration_violation_max_rad_s2"] < 1e-3
    assert blind["position_violation_max_rad"] > 0.18


def test_an_approach_without_room_or_without_limit_does_not_certify(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """A motion measured far from its limit, and a start nearer than the robot can brake."""
    far = load_robot("ur5").limits.position
    assert far is not None
    lower, upper = far.lower.copy(), far.upper.copy()
    upper[0] = 50.0
    wide = load_robot("ur5").with_limits(position=(lower, upper))
    module = sys.modules["scenarios.joint_limit_approach"]
    with monkeypatch.context() as patch:
        patch.setattr(module, "joint_oracle", lambda _, *given: joint_oracle(wide, *given))
        with pytest.raises(DikbenchError, match="deepest margin of the motion"):
            make_scenario("joint-limit-approach")
    monkeypatch.setattr(module, "BRAKING_DISTANCES", 0.5)
    with pytest.raises(DikbenchError, match="room before the limit over the braking distance"):
        make_scenario("joint-limit-approach[deceleration=2]")


@pytest.mark.parametrize("robot", SEVEN_JOINTS)
def test_the_null_space_of_an_approach_spares_its_joints(robot: str) -> None:
    """The null vector of the Jacobian has nothing of the first and the last joint, for any seed."""
    for seed in range(4):
        scenario = make_scenario(f"joint-limit-approach[robot={robot}]", seed)
        kinematics = Kinematics(scenario.robot)
        kinematics.update(scenario.q0)
        null = np.linalg.svd(kinematics.jacobian(scenario.robot.frame_id))[2][-1]
        assert null[0] ** 2 < 0.05
        assert null[-1] ** 2 < 0.05


def test_an_approach_that_the_null_space_spares_does_not_certify(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """The Panda at its usual posture moves its base with the others."""
    module = sys.modules["scenarios.joint_limit_approach"]
    usual = {"panda": tuple(load_robot("panda").q0)}
    monkeypatch.setattr(module, "POSTURES_RAD", usual)
    with pytest.raises(DikbenchError, match="its share in the least-norm motion"):
        make_scenario("joint-limit-approach[robot=panda]")


# --- start outside


@pytest.mark.parametrize("robot", JOINTS)
@pytest.mark.parametrize("outside", [1e-4, 1e-2])
def test_one_joint_starts_outside_and_the_path_leads_inside(robot: str, outside: float) -> None:
    """By the distance that was asked for, at the rate that was asked for."""
    scenario = make_scenario(f"start-outside[robot={robot},outside={outside},rate=0.1]")
    arm, j = scenario.robot, JOINTS[robot]
    seen = arm.limits.at(scenario.q0)
    assert seen.to_upper is not None
    assert seen.to_lower is not None
    assert seen.to_upper[j] == pytest.approx(-outside, rel=1e-6)
    assert np.delete(seen.to_upper, j).min() > 0.05
    assert seen.to_lower.min() > 0.05
    inside = scenario.q0.copy()
    inside[arm.limits.q_index[j]] -= 0.1
    kinematics = Kinematics(arm)
    kinematics.update(inside)
    X = kinematics.placement(arm.frame_id)
    error = pin.log6(X.actInv(scenario.reference.placement(1.0))).np
    assert np.abs(error).max() < 1e-9


def test_laws_with_limits_come_inside_at_a_bounded_rate() -> None:
    """And give up the place that they are to hold; a law without stays outside."""
    scenario = make_scenario("start-outside[robot=ur5,outside=1e-2,rate=0]")
    kept, blind = (metrics_of(law, scenario) for law in ("qp", "pinv"))
    assert scenario.robot.limits.position is not None
    assert kept["velocity_peak_ratio"] <= 0.1 + 1e-6
    assert blind["violating_share"] == 1.0
    assert kept["violating_share"] < 0.1
    assert blind["position_error_max_m"] < 1e-6


def test_a_start_inside_does_not_certify(monkeypatch: pytest.MonkeyPatch) -> None:
    """Blunted: the joint stands inside its limit."""
    monkeypatch.setattr(Range, "check", lambda *given: None)
    for outside in ("-0.01", "0", "0.1"):
        with pytest.raises(DikbenchError, match="margin at the start"):
            make_scenario(f"start-outside[outside={outside}]")


# --- greedy trap


def test_the_shortest_way_leads_through_the_limit() -> None:
    """From 0.5 the goal at 5.5 is 1.28 rad away downwards, past 0, and 5 rad upwards."""
    scenario = make_scenario("greedy-trap")
    kinematics = Kinematics(scenario.robot)
    kinematics.update(scenario.q0)
    error = pin.log6(
        kinematics.placement(scenario.robot.frame_id).actInv(scenario.reference.placement(0.0))
    ).np[5]
    assert error == pytest.approx(5.0 - 2 * pi)
    assert scenario.q0[0] + error < 0
    assert scenario.motion is not None
    assert scenario.motion.q[-1] == pytest.approx([5.5])
    assert scenario.motion.margin.min() == pytest.approx(0.5)
    assert scenario.motion.peak_speed_ratio == pytest.approx(0.8, rel=1e-3)


def test_the_way_round_keeps_every_limit() -> None:
    """The oracle, acceleration limits in force: 5 rad, nothing violated, no error at the end."""
    scenario = make_scenario("greedy-trap[acceleration=true]")
    run = simulate(
        scenario, OracleFormulation.of(scenario), make_solve(None, None), make_plant("ideal")
    )
    found = evaluate(motion_of(run.trace, scenario))
    assert found["joint_travel_rad"] == pytest.approx(5.0, abs=1e-3)
    assert found["orientation_error_final_rad"] < 1e-3
    for kind in ("position_violation_max_rad", "acceleration_violation_max_rad_s2"):
        assert found[kind] == 0.0


@pytest.mark.parametrize("law", ["qp", "lp-alpha", "drake", "hqp", "pink-qp"])
def test_every_law_that_follows_the_error_sticks(law: str) -> None:
    """At 0, as far from the goal as the start was from it, less its own way."""
    found = metrics_of(law, make_scenario("greedy-trap"))
    assert found["orientation_error_final_rad"] == pytest.approx(2 * pi - 5.5, abs=1e-2)
    assert found["position_violation_max_rad"] < 1e-6
    assert found["stuck_share"] > 0.5


def test_a_trap_that_is_none_does_not_certify(monkeypatch: pytest.MonkeyPatch) -> None:
    """A goal whose shortest way is inside, and one that nothing reaches."""
    monkeypatch.setattr(Range, "check", lambda *given: None)
    with pytest.raises(DikbenchError, match="end of the shortest way"):
        make_scenario("greedy-trap[start=1,goal=3]")
    with pytest.raises(DikbenchError, match="margin of the way round"):
        make_scenario("greedy-trap[start=0.02,goal=5.5]")


@pytest.mark.parametrize(
    ("selector", "parts"),
    [
        ("joint-limit-approach[deceleration=1]", ["deceleration=1.0 must be 2 to 50"]),
        ("joint-limit-approach[joint=elbow]", ["joint='elbow' is not valid", "pan, wrist_3"]),
        (
            "joint-limit-approach[robot=talos]",
            ["robot='talos' is not valid", "ur5, ur3, ur10, panda, xarm7, tiago, lwr"],
        ),
        ("start-outside[outside=0.1]", ["outside=0.1 must be 0.0001 to 0.01"]),
        ("start-outside[rate=-1]", ["rate=-1.0 must be 0 to 0.5"]),
        ("greedy-trap[goal=4]", ["goal=4.0 must be 4.9 to 6"]),
    ],
)
def test_what_cannot_be_is_one_line(selector: str, parts: list[str]) -> None:
    """The parameter and its range."""
    message = scenario_error(selector)
    for part in parts:
        assert part in message
