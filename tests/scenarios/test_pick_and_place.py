"""Pick and place: where it goes, when it rests, how fast it is."""

from __future__ import annotations

import numpy as np
import pinocchio as pin
import pytest
from makers.problems import with_upper_limit
from makers.scenarios import TWENTY_SEEDS, metrics_of, put_robot, scenario_error

from dikbench.errors import DikbenchError
from dikbench.plugins.building import make_scenario
from dikbench.robots.kinematics import Kinematics
from scenarios.pick_and_place import PickAndPlace

# Of the duration, when each leg ends: approach, down, grasp, lift, carry, down, release, up.
ENDS = (0.2, 0.3, 0.35, 0.45, 0.75, 0.85, 0.9, 1.0)
GRASP, LIFTED, CARRIED, PLACED = 0.325, 0.45, 0.75, 0.875


def test_the_object_is_lifted_carried_across_turned_and_put_down() -> None:
    """By the lengths and the angle given, about the start, which is left and not met again."""
    scenario = make_scenario("pick-and-place[robot=ur5,width=0.24,height=0.08,turn=0.6]")
    at = scenario.reference.placement
    T = scenario.reference.duration
    start, grasp, lifted, carried, placed = (
        at(share * T) for share in (0.0, GRASP, LIFTED, CARRIED, PLACED)
    )
    up = np.array([0.0, 0.0, 0.08])
    assert lifted.translation - grasp.translation == pytest.approx(up)
    assert carried.translation - placed.translation == pytest.approx(up)
    across = carried.translation - lifted.translation
    assert np.linalg.norm(across) == pytest.approx(0.24)
    assert across[2] == pytest.approx(0.0, abs=1e-12)
    assert across @ start.translation == pytest.approx(0.0, abs=1e-9)  # at a right angle to the arm
    assert (lifted.translation + carried.translation) / 2 == pytest.approx(start.translation)
    turned = pin.log3(placed.rotation @ grasp.rotation.T)
    assert turned == pytest.approx(np.array([0.0, 0.0, 0.6]))
    assert lifted.rotation == pytest.approx(grasp.rotation)


def test_it_rests_between_the_legs_and_while_it_grasps() -> None:
    """At the end of every leg, and all through the two dwells."""
    reference = make_scenario("pick-and-place").reference
    for share in (0.0, *ENDS, 0.31, 0.34, 0.86, 0.89):
        assert np.abs(reference.velocity(share * reference.duration)).max() < 1e-9
    for share in (0.1, 0.25, 0.4, 0.6, 0.8, 0.95):
        assert np.abs(reference.velocity(share * reference.duration)).max() > 0.05


@pytest.mark.parametrize("seeds", TWENTY_SEEDS, ids=["few", "many"])
@pytest.mark.parametrize("robot", PickAndPlace.robots)
def test_every_arm_does_it_from_twenty_starts(robot: str, seeds: range) -> None:
    """The certificate holds (building asserts it), and the oracle is where the reference is."""
    for seed in seeds:
        scenario = make_scenario(f"pick-and-place[robot={robot}]", seed)
        motion, kinematics = scenario.motion, Kinematics(scenario.robot)
        assert motion is not None
        assert motion.peak_speed_ratio == pytest.approx(0.8, rel=0.02)
        for tau, q in zip(motion.instants[::40], motion.q[::40], strict=True):
            kinematics.update(q)
            X = kinematics.placement(scenario.robot.frame_id)
            wanted = scenario.reference.placement(tau).homogeneous
            assert X.homogeneous == pytest.approx(wanted, abs=1e-8)


@pytest.mark.parametrize("robot", PickAndPlace.robots)
def test_the_peak_speed_is_that_of_the_pseudo_inverse(robot: str) -> None:
    """Recomputed without the oracle: the largest least-norm velocity on the path over its limit."""
    scenario = make_scenario(f"pick-and-place[robot={robot}]")
    arm, motion = scenario.robot, scenario.motion
    assert motion is not None
    velocity = arm.limits.velocity
    assert velocity is not None
    kinematics, peak = Kinematics(arm), 0.0
    for tau, q in zip(motion.instants, motion.q, strict=True):
        kinematics.update(q)
        v = np.linalg.pinv(kinematics.jacobian(arm.frame_id)) @ scenario.reference.velocity(tau)
        peak = max(peak, float((np.abs(v) / velocity.upper).max()))
    assert peak == pytest.approx(0.8, rel=0.03)


def test_inside_the_limits_every_law_arrives() -> None:
    """At 0.8 of the speed limits a law without them breaks none, and the others lose nothing."""
    scenario = make_scenario("pick-and-place[robot=ur5,dt=0.005]")
    for law in ("pinv", "pinv[after=clip]", "qp", "lp-alpha"):
        seen = metrics_of(law, scenario)
        assert seen["velocity_peak_ratio"] < 1
        assert seen["position_error_max_m"] < 3e-3


def test_faster_than_the_limits_only_some_laws_keep_them() -> None:
    """At 1.5 times: pinv breaks them, scaling keeps them and falls behind."""
    scenario = make_scenario("pick-and-place[robot=ur5,speed=1.5,dt=0.005]")
    free, scaled = metrics_of("pinv", scenario), metrics_of("lp-alpha", scenario)
    assert free["velocity_peak_ratio"] == pytest.approx(1.5, rel=0.03)
    assert scaled["velocity_peak_ratio"] < 1 + 1e-6
    assert scaled["position_error_max_m"] > 3 * free["position_error_max_m"]


def test_a_place_next_to_a_limit_is_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    """Where the base cannot turn so far, the certificate says so."""
    put_robot(monkeypatch, with_upper_limit("ur5", 0, 0.4))
    with pytest.raises(DikbenchError, match="position margin"):
        make_scenario("pick-and-place[robot=ur5]")


@pytest.mark.parametrize(
    ("selector", "words"),
    [
        ("pick-and-place[width=1]", "width=1.0 must be 0.1 to 0.4"),
        ("pick-and-place[height=0]", "height=0.0 must be 0.02 to 0.15"),
        ("pick-and-place[turn=-1]", "turn=-1.0 must be 0 to 1.5"),
        ("pick-and-place[speed=9]", "speed=9.0 must be 0.1 to 3"),
        ("pick-and-place[robot=talos,width=0.4,turn=1.5]", "position margin [rad]"),
        ("pick-and-place[robot=planar3r]", "robot planar3r moves in a plane and cannot lift"),
    ],
)
def test_errors_say_what_is_valid(selector: str, words: str) -> None:
    """One line each."""
    assert words in scenario_error(selector)
