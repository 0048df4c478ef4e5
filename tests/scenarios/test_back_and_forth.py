"""Back and forth: pink_bench's trajectory, written down anew, and what laws make of it."""

from __future__ import annotations

import sys
from types import MappingProxyType

import numpy as np
import pinocchio as pin
import pytest
from makers.scenarios import TWENTY_SEEDS, metrics_of, put_robot
from scipy.spatial.transform import Rotation

from dikbench.errors import DikbenchError
from dikbench.plugins.building import make_scenario
from dikbench.robots.kinematics import Kinematics
from dikbench.robots.loading import load_robot
from scenarios.back_and_forth import SET_UPS

# Frame, scale and roll about x, as published.
PUBLISHED = {
    "ur3": ("ee_link", 0.5, 0.0),
    "ur5": ("ee_link", 0.9, 0.0),
    "ur10": ("ee_link", 1.0, 0.0),
    "panda": ("panda_hand", 0.7, np.pi / 2),
}


@pytest.mark.parametrize("robot", PUBLISHED)
def test_it_is_the_published_trajectory(robot: str) -> None:
    """Position and yaw, pitch, roll, by another library's angles, for ten seconds every 5 ms."""
    frame, scale, roll = PUBLISHED[robot]
    scenario = make_scenario(f"back-and-forth[robot={robot}]")
    assert scenario.robot.frame == frame
    assert (scenario.reference.duration, scenario.dt) == (10.0, 0.005)
    for t in np.linspace(0.0, 10.0, 37):
        s = np.sin(t) ** 2
        X = scenario.reference.placement(t)
        first, last = np.array([0.4, 0.8, 0.4]), np.array([-0.4, 0.6, 0.6])
        assert X.translation == pytest.approx(scale * ((1 - s) * first + s * last))
        angles = [np.pi / 4 * (1 + s), 0.0, np.pi / 4 * s]
        wanted = Rotation.from_euler("ZYX", angles) * Rotation.from_euler("x", roll)
        assert X.rotation == pytest.approx(wanted.as_matrix())


@pytest.mark.parametrize("robot", ["ur3", "panda", "lwr"])
@pytest.mark.parametrize("size", [0.4, 0.9])
def test_a_smaller_one_is_the_middle_of_the_same_path(robot: str, size: float) -> None:
    """At sin^2 of (1 - size)/2 + size sin^2 t, of a known path and of the largest."""
    whole, part = (
        make_scenario(f"back-and-forth[robot={robot},size={share}]", 3).reference
        for share in (1.0, size)
    )
    assert part.duration == whole.duration
    pace = whole.duration / 10.0
    for t in np.linspace(0.0, 3.0, 11):
        there = np.arcsin(np.sqrt((1 - size) / 2 + size * np.sin(t) ** 2))
        wanted = whole.placement(pace * there).homogeneous
        assert part.placement(pace * t).homogeneous == pytest.approx(wanted, abs=1e-12)


@pytest.mark.parametrize("seed", [0, 1])
@pytest.mark.parametrize("given", [*PUBLISHED, "ur5,size=0.4", "xarm7,size=0.6"])
def test_velocity_is_the_derivative_of_the_placement(given: str, seed: int) -> None:
    """The body twist, by central differences."""
    reference, h = make_scenario(f"back-and-forth[robot={given}]", seed).reference, 1e-5
    for tau in (0.3, 0.8, 1.9, 4.4, 8.1):
        before, after = reference.placement(tau - h), reference.placement(tau + h)
        twist = pin.log6(before.actInv(after)).np / (2 * h)
        assert reference.velocity(tau) == pytest.approx(twist, abs=1e-8)


@pytest.mark.parametrize("seeds", TWENTY_SEEDS, ids=["few", "many"])
@pytest.mark.parametrize("robot", PUBLISHED)
def test_it_starts_on_the_path_at_rest_and_inside_the_limits(robot: str, seeds: range) -> None:
    """For twenty seeds; so does the whole joint motion, half a radian inside."""
    for seed in seeds:
        scenario = make_scenario(f"back-and-forth[robot={robot}]", seed)
        kinematics = Kinematics(scenario.robot)
        kinematics.update(scenario.q0)
        X = kinematics.placement(scenario.robot.frame_id)
        wanted = scenario.reference.placement(0.0).homogeneous
        assert X.homogeneous == pytest.approx(wanted, abs=1e-8)
        assert np.abs(scenario.v0).max() < 1e-12
        position, motion = scenario.robot.limits.position, scenario.motion
        assert position is not None
        assert motion is not None
        assert np.minimum(position.upper - motion.q, motion.q - position.lower).min() > 0.5


def test_a_seed_turns_it_about_the_vertical_and_changes_its_pace() -> None:
    """By at most 0.2 rad and 10 %; heights stay."""
    plain = make_scenario("back-and-forth")
    for seed in (1, 2, 3):
        other = make_scenario("back-and-forth", seed)
        assert 0.9 <= other.reference.duration / plain.reference.duration <= 1.1
        for share in (0.0, 0.13):
            a = plain.reference.placement(share * plain.reference.duration)
            b = other.reference.placement(share * other.reference.duration)
            turned = pin.log3(b.rotation @ a.rotation.T)
            assert turned[:2] == pytest.approx(np.zeros(2), abs=1e-9)
            assert 1e-4 < abs(turned[2]) <= 0.2
            assert b.translation == pytest.approx(pin.exp3(turned) @ a.translation)


def test_feed_forward_follows_to_the_discretization() -> None:
    """Nothing is in the way: the error is what a step of dt leaves, and halves with dt."""
    coarse, fine = (
        metrics_of("qp", make_scenario(f"back-and-forth[robot=ur10,dt={dt}]"))[
            "position_error_rms_m"
        ]
        for dt in (0.02, 0.01)
    )
    assert coarse < 3e-3
    assert fine == pytest.approx(coarse / 2, rel=0.05)


def test_a_slow_sweep_is_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    """With joints that are three times as fast it asks for too little of them."""
    arm = load_robot("ur5", "ee_link")
    velocity = arm.limits.velocity
    assert velocity is not None
    fast = arm.with_limits(velocity=3 * velocity.upper)
    put_robot(monkeypatch, fast)
    with pytest.raises(DikbenchError, match="required speed over limit"):
        make_scenario("back-and-forth")


@pytest.mark.parametrize("robot", [*PUBLISHED, "ur5,size=0.4"])
def test_a_tenth_of_the_sweep_is_refused(robot: str, monkeypatch: pytest.MonkeyPatch) -> None:
    """A path that is no sweep any more: only the rotation is left of it."""
    module = sys.modules["scenarios.back_and_forth"]
    monkeypatch.setattr(module, "STOP_M", module.START_M + 0.1 * (module.STOP_M - module.START_M))
    with pytest.raises(DikbenchError, match="sweep from end to end"):
        make_scenario(f"back-and-forth[robot={robot}]")


def test_a_path_out_of_reach_is_an_error(monkeypatch: pytest.MonkeyPatch) -> None:
    """The UR3 with the UR10's scale."""
    module = sys.modules["scenarios.back_and_forth"]
    small = SET_UPS["ur3"]
    far = type(small)(small.frame, 1.0, small.roll, small.near, small.speed, small.sigma_min)
    monkeypatch.setattr(module, "SET_UPS", MappingProxyType({"ur3": far}))
    with pytest.raises(DikbenchError, match="robot ur3: no posture found"):
        make_scenario("back-and-forth[robot=ur3]")


def test_errors_say_what_is_valid() -> None:
    """One line each."""
    for selector, words in (
        ("back-and-forth[robot=base]", "no sweep about the start of robot base can be followed"),
        ("back-and-forth[size=0.1]", "size=0.1 must be 0.2 to 1"),
        ("back-and-forth[dt=-1]", "dt=-1.0 must be finite and above 0"),
    ):
        with pytest.raises(DikbenchError) as caught:
            make_scenario(selector)
        assert words in str(caught.value)
        assert "\n" not in str(caught.value)
