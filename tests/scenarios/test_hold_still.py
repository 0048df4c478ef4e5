"""Holding still: nothing moves without noise; with it, what is near shows."""

from __future__ import annotations

import sys
from types import MappingProxyType

import numpy as np
import pytest
from makers.scenarios import metrics_of, put_robot, scenario_error

from dikbench.errors import DikbenchError
from dikbench.plugins.building import make_scenario
from dikbench.robots.kinematics import Kinematics
from dikbench.robots.loading import load_robot
from scenarios.hold_still import POSTURES, Postures

NOISY = "ideal[noise=0.003]"


@pytest.mark.parametrize("robot", POSTURES)
@pytest.mark.parametrize("posture", ["start", "singular", "limit"])
@pytest.mark.parametrize("distance", [0.001, 0.003, 0.01])
def test_it_stands_where_it_says_from_any_seed(robot: str, posture: str, distance: float) -> None:
    """Singular value and margin recomputed: one of them small, or neither; inside the limits."""
    for seed in range(7):
        selector = f"hold-still[robot={robot},posture={posture},distance={distance}]"
        scenario = make_scenario(selector, seed)
        kinematics, position = Kinematics(scenario.robot), scenario.robot.limits.position
        assert position is not None
        kinematics.update(scenario.q0)
        X = kinematics.placement(scenario.robot.frame_id)
        assert X.homogeneous == pytest.approx(scenario.reference.placement(3.0).homogeneous)
        J = kinematics.jacobian(scenario.robot.frame_id)
        sigma = np.linalg.svd(J, compute_uv=False)[-1]
        margin = np.minimum(position.upper - scenario.q0, scenario.q0 - position.lower).min()
        assert (sigma < 0.7 * distance) == (posture == "singular")
        assert sigma > distance / 30
        assert (margin < 0.1) == (posture == "limit")
        assert margin > 0.99 * distance


def test_a_wrist_this_near_is_singular_to_first_order() -> None:
    """A UR's sigma_min is proportional to the wrist's angle: about 0.4 m/rad on a UR5."""
    scenario = make_scenario("hold-still[robot=ur5,posture=singular]")
    claims = {c.quantity.partition(" ")[0]: c.value for c in scenario.certificate.claims}
    assert claims["smallest"] == pytest.approx(0.397 * 0.003, rel=0.02)


@pytest.mark.parametrize("posture", ["start", "singular", "limit"])
@pytest.mark.parametrize("law", ["pinv", "pinv[after=clip]", "dls", "nullspace", "qp", "lp-alpha"])
def test_measured_exactly_no_law_moves(law: str, posture: str) -> None:
    """No joint by more than 1e-6 rad in 10 s."""
    scenario = make_scenario(f"hold-still[posture={posture},dt=0.05]")
    assert metrics_of(law, scenario)["joint_travel_rad"] < 1e-6


def test_noise_next_to_a_singularity_makes_the_pseudo_inverse_jump() -> None:
    """Beyond the joints' limits on the UR5, where damping makes a hundredth of that."""
    scenario = make_scenario("hold-still[robot=ur5,posture=singular]")
    free, damped = (
        metrics_of(law, scenario, NOISY)["velocity_peak_ratio"] for law in ("pinv", "dls")
    )
    assert free > 1
    assert damped < 0.01 * free


def test_noise_far_from_a_singularity_is_not_magnified() -> None:
    """It lies in the range of J: ||J^+ J dq|| <= ||dq||, whatever the posture, times the gain."""
    scenario = make_scenario("hold-still[robot=ur5]")
    velocity = scenario.robot.limits.velocity
    assert velocity is not None
    # Of 6000 normal numbers none is above 5.5 deviations; six of them make a norm.
    most = 5.0 * 5.5 * 0.003 * np.sqrt(6) / velocity.upper.min()
    assert metrics_of("pinv", scenario, NOISY)["velocity_peak_ratio"] < most


def test_noise_next_to_a_limit_sends_laws_that_know_it_off_course() -> None:
    """The joint seems to be outside and is told to come back; a law without limits stays calm."""
    scenario = make_scenario("hold-still[posture=limit]")
    blind, knowing = metrics_of("pinv", scenario, NOISY), metrics_of("qp", scenario, NOISY)
    assert blind["direction_error_max_rad"] < 0.05
    assert knowing["direction_error_max_rad"] > 1
    assert knowing["velocity_peak_ratio"] > 2 * blind["velocity_peak_ratio"]


def test_postures_that_are_not_near_are_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    """A wrist half a radian from its singularity, and a limit that is out of reach."""
    module = sys.modules["scenarios.hold_still"]
    bent = Postures((0.3, -1.2, 1.4, -1.0, 0.5, 0.2), (4, 1.0), (4,), 0)
    monkeypatch.setattr(module, "POSTURES", MappingProxyType({"ur5": bent}))
    with pytest.raises(DikbenchError, match="smallest singular value"):
        make_scenario("hold-still[robot=ur5,posture=singular]")
    monkeypatch.setattr(module, "AT_LIMIT", (100.0, 200.0))
    with pytest.raises(DikbenchError, match="position margin"):
        make_scenario("hold-still[robot=ur5,posture=limit]")
    put_robot(monkeypatch, load_robot("ur5").with_limits(position=None))
    with pytest.raises(DikbenchError, match="robot ur5 has no position limits"):
        make_scenario("hold-still[robot=ur5,posture=limit]")


@pytest.mark.parametrize(
    ("selector", "words"),
    [
        ("hold-still[robot=base,posture=singular]", "robot base has no posture=singular"),
        ("hold-still[posture=elbow]", "valid: start, singular, limit"),
        ("hold-still[distance=0]", "distance=0.0 must be above 0 and at most 0.02"),
        ("hold-still[gain=0]", "gain=0.0 must be finite and above 0"),
    ],
)
def test_errors_say_what_is_valid(selector: str, words: str) -> None:
    """One line each."""
    assert words in scenario_error(selector)
