"""Two tasks that cannot both be done, and a base that drifts without the logarithm's derivative."""

from __future__ import annotations

import sys
from collections.abc import Mapping
from dataclasses import replace
from math import pi
from types import MappingProxyType

import numpy as np
import pytest
from makers.scenarios import metrics_of, scenario_error

from dikbench.errors import DikbenchError
from dikbench.parameters import Range
from dikbench.plugins.building import make_scenario
from dikbench.problem.tasks import PositionTask
from dikbench.robots.kinematics import Kinematics
from scenarios.task_conflict import CONFLICTS

# --- conflict


@pytest.mark.parametrize("robot", CONFLICTS)
def test_half_way_the_second_task_has_less_rank_in_what_the_first_leaves(robot: str) -> None:
    """rank(J_2 N_1) < rank J_2, by numpy's rank, from the Jacobians of the frames."""
    scenario = make_scenario(f"task-conflict[robot={robot}]")
    assert scenario.motion is not None
    kinematics = Kinematics(scenario.robot)
    kinematics.update(scenario.motion.q[len(scenario.motion.q) // 2])
    J1 = kinematics.jacobian(scenario.robot.frame_id)[list(scenario.rows)]
    frame = scenario.robot.model.getFrameId(CONFLICTS[robot].elbow)
    J2 = kinematics.jacobian(frame)[:3]
    N1 = np.eye(scenario.robot.nv) - np.linalg.pinv(J1, rcond=1e-9) @ J1
    ranks = [np.linalg.matrix_rank(matrix, tol=2e-3) for matrix in (J2 @ N1, J2, J1)]
    assert ranks[0] < ranks[1]
    assert ranks[2] == len(scenario.rows)


@pytest.mark.parametrize("robot", CONFLICTS)
def test_strict_priorities_keep_the_hand_and_weights_do_not(robot: str) -> None:
    """The hand's error: none for strict laws, centimetres for equal weights; the elbow's: both."""
    scenario = make_scenario(f"task-conflict[robot={robot}]")
    strict, weighted = (metrics_of(law, scenario) for law in ("hqp", "qp"))
    assert strict["position_error_max_m"] < 5e-3
    assert weighted["position_error_max_m"] > 5e-3
    assert weighted["position_error_max_m"] > 5 * strict["position_error_max_m"]
    assert strict["second_task_error_rms"] > 0.01
    assert strict["second_task_error_rms"] > weighted["second_task_error_rms"]


def test_the_projection_is_singular_where_only_the_tasks_meet() -> None:
    """On planar4r recursive projection asks for far more speed than the robust form does."""
    scenario = make_scenario("task-conflict[robot=planar4r]")
    recursive, robust = (metrics_of(law, scenario) for law in ("nullspace", "nullspace-robust"))
    assert recursive["velocity_peak_ratio"] > 2 * robust["velocity_peak_ratio"]
    assert robust["position_error_max_m"] < 2e-3


def test_the_second_error_is_the_elbows_distance_from_where_it_is_wanted() -> None:
    """At the start of a law that stands still it is the offset of the table."""
    scenario = make_scenario("task-conflict[robot=panda,speed=0.05]")
    (task,) = scenario.tasks
    assert isinstance(task, PositionTask)
    kinematics = Kinematics(scenario.robot)
    kinematics.update(scenario.q0)
    offset = np.linalg.norm(CONFLICTS["panda"].offset)
    assert np.linalg.norm(task.linearize(kinematics).error) == pytest.approx(offset)
    final = metrics_of("nullspace", scenario)["second_task_error_final"]
    assert 0.02 < final < offset
    assert np.isnan(metrics_of("pinv", make_scenario("near-miss"))["second_task_error_rms"])


def test_tasks_that_agree_do_not_certify(monkeypatch: pytest.MonkeyPatch) -> None:
    """Blunted: half way the arm is bent, and the elbow stays where it is wanted."""
    module = sys.modules["scenarios.task_conflict"]
    blunt: Mapping[str, object] = MappingProxyType(
        {"planar4r": replace(CONFLICTS["planar4r"], middle=(0.5, 0.6, 0.5, 1.2))}
    )
    monkeypatch.setattr(module, "CONFLICTS", blunt)
    with pytest.raises(DikbenchError, match=r"J_2 N_1 half way .*, must be"):
        make_scenario("task-conflict[robot=planar4r]")


# --- drift


@pytest.mark.parametrize(
    ("added", "without", "with_it"),
    [(0.0, 0.859, 0.859), (1e-10, 1.048, 0.697), (1e-8, 2.048, 0.600), (1e-6, 2.904, 0.600)],
)
def test_the_drift_of_a_base(added: float, without: float, with_it: float) -> None:
    """Science fact 5 and its table, to 1 %: the ideal way is 0.600 m; `added` is what P gains."""
    scenario = make_scenario("log-derivative-drift")
    for flag, expected in (("false", without), ("true", with_it)):
        law = f"qp[damping={added**0.5!r},log_derivative={flag}]"
        assert metrics_of(law, scenario)["path_length_m"] == pytest.approx(expected, rel=0.01)


def test_the_square_wave_is_as_asked() -> None:
    """Origin, then back and turned, then again; weights are costs squared."""
    scenario = make_scenario("log-derivative-drift")
    assert scenario.duration == pytest.approx(8.0)
    for time, there in ((0.0, 0), (1.99, 0), (2.0, 1), (3.99, 1), (4.0, 0), (6.0, 1), (8.0, 1)):
        X = scenario.reference.placement(time)
        assert X.translation == pytest.approx([-0.2 * there, 0, 0])
        yaw = np.arctan2(X.rotation[1, 0], X.rotation[0, 0])
        assert yaw == pytest.approx(-0.9 * pi * there)
    assert scenario.tracking.gain * scenario.dt == pytest.approx(0.05)
    weight = scenario.tracking.weight  # type: ignore[attr-defined]
    assert weight == pytest.approx([1.0, 1.0, 1e-10])


def test_a_drift_without_a_turn_does_not_certify(monkeypatch: pytest.MonkeyPatch) -> None:
    """Blunted: nothing to swing out for."""
    module = sys.modules["scenarios.log_derivative_drift"]
    monkeypatch.setattr(Range, "check", lambda *given: None)
    monkeypatch.setattr(module.LogDerivativeDrift, "check", lambda family: None)
    with pytest.raises(DikbenchError, match="length of the screw over the distance"):
        make_scenario("log-derivative-drift[turn=0.6]")
    with pytest.raises(DikbenchError, match="yaw between the poses"):
        make_scenario("log-derivative-drift[turn=3.1]")


@pytest.mark.parametrize("seed", [0, 1, 2, 3])
def test_with_the_derivative_the_base_goes_straight_and_arrives(seed: int) -> None:
    """The ideal 0.600 m from every seed, which starts at its first pose, and no error at the end.

    The error at the end is the one to the last pose, not to the one that would come next.
    """
    scenario = make_scenario("log-derivative-drift", seed)
    found = metrics_of("qp[damping=0.001,log_derivative=true]", scenario)
    assert found["path_length_m"] == pytest.approx(0.6, rel=0.01)
    assert found["position_error_final_m"] < 1e-3
    assert metrics_of("qp[damping=0.001]", scenario)["path_length_m"] > 2.0


def test_a_base_that_does_not_turn_spirals_in() -> None:
    """Damping far above the weight: the drift is a product in the complex plane.

    p the base as seen from a target at an angle theta: a step of gain g takes it to
    (1 - g (a + i b)) p with a = theta/2 cot(theta/2), b = theta/2; where theta is 0, straight on.
    """
    half = 0.45 * pi
    spiral = 0.05 * complex(half / np.tan(half), half)
    p, length = 0j, 0.0  # the base; the targets are 0 and -0.2
    for target, rate in ((0.0, 0.05), (-0.2, spiral), (0.0, 0.05), (-0.2, spiral)):
        for _ in range(200):
            step = -rate * (p - target)
            p, length = p + step, length + abs(step)
    scenario = make_scenario("log-derivative-drift[orientation_cost=1e-6]")
    found = metrics_of("qp[damping=0.001]", scenario)
    assert found["path_length_m"] == pytest.approx(length, rel=1e-3)


@pytest.mark.parametrize(
    ("selector", "part"),
    [
        ("task-conflict[robot=ur5]", "planar4r, planar3r, panda"),
        ("task-conflict[speed=2]", "speed=2.0 must be 0.05 to 0.9"),
        ("log-derivative-drift[turn=3.2]", "turn=3.2 must be -3 to 3 [rad]"),
        ("log-derivative-drift[turn=-1.5]", "turn=-1.5 must be -3 to -2 or 2 to 3 [rad]"),
        ("log-derivative-drift[robot=panda]", "robot='panda' is not valid; valid: base"),
    ],
)
def test_what_cannot_be_is_one_line(selector: str, part: str) -> None:
    """The parameter and its range."""
    assert part in scenario_error(selector)
