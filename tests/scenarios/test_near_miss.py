"""Near misses of any arm's singularities: the path, what it asks for, and what it refuses."""

from __future__ import annotations

import importlib.metadata
import sys
from dataclasses import replace
from itertools import pairwise
from pathlib import Path

import numpy as np
import pinocchio as pin
import pytest
from makers.scenarios import known_singularity, scenario_error, scenario_of
from makers.turns import in_turns
from makers.urdfs import SIX, write_arm

from dikbench.arrays import Array
from dikbench.errors import DikbenchError
from dikbench.plugins.building import make_scenario
from dikbench.robots.kinematics import Kinematics, smallest_singular_value
from dikbench.robots.robot import Robot
from dikbench.scenario import Claim, Range, Scenario
from dikbench.scenario.oracle import OracleMotion
from dikbench.scenario.singularity import Singularity
from scenarios.singular_postures import SINGULAR_POSTURES

KNOWN = [(robot, name) for robot, postures in SINGULAR_POSTURES.items() for name in postures]
MISSES = (0.02, 0.01, 0.005, 0.002)


def _selector(robot: str, name: str, miss: float, more: str = "") -> str:
    return f"near-miss[robot={robot},singularity={name},miss={miss}{more}]"


def _motion(scenario: Scenario) -> OracleMotion:
    assert scenario.motion is not None
    return scenario.motion


def _urdf(ending: str) -> str:
    for file in importlib.metadata.distribution("example-robot-data").files or ():
        if str(file).endswith(ending):
            return str(file.locate())
    pytest.fail(f"example-robot-data has no {ending}")


# --- the path and its motion


@pytest.mark.parametrize(("known", "miss"), in_turns(KNOWN, MISSES))
def test_the_path_misses_the_singular_placement_by_miss(
    known: tuple[str, str], miss: float
) -> None:
    """Half way, by a twist of that length; and nowhere is it nearer."""
    robot, name = known
    scenario = scenario_of(_selector(robot, name, miss))
    X_s = known_singularity(robot, name)[1].placement
    reference = scenario.reference

    def distance(share: float) -> float:
        X = reference.placement(share * reference.duration)
        return float(np.linalg.norm(pin.log6(X_s.actInv(X)).np))

    assert distance(0.5) == pytest.approx(miss, rel=1e-9)
    assert all(distance(share) >= miss - 1e-9 for share in np.linspace(0, 1, 41))


@pytest.mark.parametrize(("robot", "name"), KNOWN)
def test_the_motion_follows_the_path_inside_the_limits(robot: str, name: str) -> None:
    """Recomputed from its configurations: placement, singular values, margins and speeds."""
    scenario = scenario_of(_selector(robot, name, 0.01))
    motion, arm = _motion(scenario), scenario.robot
    kinematics = Kinematics(arm)
    for q, tau, sigma in zip(motion.q, motion.instants, motion.sigma_min, strict=True):
        kinematics.update(q)
        X = kinematics.placement(arm.frame_id)
        error = pin.log6(X.actInv(scenario.reference.placement(tau))).np
        assert np.abs(error).max() < 1e-8
        J = kinematics.jacobian(arm.frame_id)
        assert smallest_singular_value(J) == pytest.approx(sigma, abs=1e-12)
    seen = [arm.limits.at(q) for q in motion.q]
    margin = min(min(s.to_lower.min(), s.to_upper.min()) for s in seen)  # type: ignore[union-attr]
    assert margin == pytest.approx(motion.margin.min())
    assert margin >= 0.05
    steps = np.array([pin.difference(arm.model, a, b) for a, b in pairwise(motion.q)])
    v = steps / np.diff(motion.instants)[:, None]
    assert arm.limits.velocity is not None
    ratio = np.abs(v) / arm.limits.velocity.upper
    assert ratio.max() == pytest.approx(motion.peak_speed_ratio)


def _peaks(robot: str, name: str, misses: tuple[float, ...]) -> tuple[Array, Array]:
    found = [_motion(scenario_of(_selector(robot, name, miss))) for miss in misses]
    return np.array([m.sigma_min.min() for m in found]), np.array(
        [np.abs(m.v).max() for m in found]
    )


@pytest.mark.parametrize(("robot", "name"), KNOWN)
def test_a_nearer_miss_asks_for_more(robot: str, name: str) -> None:
    """Speed grows as 1/miss past a crossing, as 1/sqrt(miss) at a fold or a saddle."""
    sigma, peak = _peaks(robot, name, MISSES)
    assert np.all(np.diff(sigma) < 0)
    assert np.all(np.diff(peak) > 0)
    kind = known_singularity(robot, name)[1].kind
    power = np.log(peak[-1] / peak[-2]) / np.log(MISSES[-2] / MISSES[-1])
    assert power == pytest.approx(1.0 if kind == "crossing" else 0.5, abs=0.12)


@pytest.mark.parametrize("robot", ["ur3", "ur5", "ur10", "kinova"])
def test_crossing_exactly_is_easy(robot: str) -> None:
    """With miss = 0 the single joint's own motion does it, at its own speed."""
    scenario = make_scenario(_selector(robot, "wrist", 0.0, ",speed=0.4"))
    motion = _motion(scenario)
    assert np.abs(motion.v).max() == pytest.approx(0.4, rel=1e-4)
    assert motion.sigma_min.min() < 1e-6
    moving = np.abs(motion.v).max(axis=0) > 1e-6
    assert list(np.flatnonzero(moving)) == [4]


@pytest.mark.parametrize(("robot", "name"), [("ur5", "wrist"), ("panda", "elbow")])
def test_speed_scales_the_motion(robot: str, name: str) -> None:
    """Twice the speed on the same path: half the time, twice what is required."""
    slow, fast = (
        make_scenario(_selector(robot, name, 0.01, f",speed={speed}")) for speed in (0.2, 0.4)
    )
    assert slow.reference.duration == pytest.approx(2 * fast.reference.duration)
    assert _motion(slow).q == pytest.approx(_motion(fast).q, abs=1e-9)
    ratio = _motion(fast).peak_speed_ratio / _motion(slow).peak_speed_ratio
    assert ratio == pytest.approx(2.0)


def test_a_seed_changes_start_and_timing_within_the_ranges() -> None:
    """Other joints and another speed; the miss and the singularity stay."""
    plain = make_scenario(_selector("ur5", "wrist", 0.01))
    for seed in range(1, 6):
        other = make_scenario(_selector("ur5", "wrist", 0.01), seed)
        assert 0 < np.abs(other.q0 - plain.q0).max() < 0.25
        assert 0 < abs(other.reference.duration / plain.reference.duration - 1) <= 0.1 + 1e-9
        middle = _motion(other).sigma_min.min()
        assert middle == pytest.approx(_motion(plain).sigma_min.min(), rel=0.3)


# --- robots of one's own


def test_auto_is_the_first_known_singularity() -> None:
    """Of a robot in the table."""
    auto = make_scenario("near-miss[robot=panda,miss=0.01]")
    elbow = make_scenario("near-miss[robot=panda,singularity=elbow,miss=0.01]")
    assert np.array_equal(auto.q0, elbow.q0)


@pytest.mark.parametrize(
    ("ending", "frame"),
    [
        ("kinova_description/robots/kinova.urdf", "j2s6s200_end_effector"),
        ("xarm_description/urdf/xarm7.urdf", "link_eef"),
        ("panda_description/urdf/panda.urdf", "panda_hand"),
        ("ur_description/urdf/ur5_joint_limited_robot.urdf", "ee_link"),
    ],
)
def test_any_urdf_has_a_near_miss(ending: str, frame: str) -> None:
    """A singular posture is searched, and the same certificate holds."""
    scenario = make_scenario(f"near-miss[robot={_urdf(ending)},frame={frame},miss=0.01]")
    motion = _motion(scenario)
    assert motion.sigma_min.min() < 0.7 * motion.sigma_min.max()
    assert motion.margin.min() >= 0.05
    assert scenario.steps > 10


# --- what it refuses


def test_a_blunted_path_does_not_certify(monkeypatch: pytest.MonkeyPatch) -> None:
    """At a distance of 0.5 there is no singularity to speak of: an error, not a quiet run."""
    monkeypatch.setattr(Range, "check", lambda *given: None)
    for robot, name in KNOWN:
        with pytest.raises(DikbenchError, match=r"certificate of .* failed|cannot be followed"):
            make_scenario(_selector(robot, name, 0.5))


def test_a_slowed_motion_does_not_certify(monkeypatch: pytest.MonkeyPatch) -> None:
    """A motion at a quarter of the speed that was asked for fails its claim on the speed."""
    module = sys.modules["scenarios.near_miss"]
    claims = module._claims

    def of_a_slower_motion(
        arm: Robot, where: Singularity, miss: float, speed: float, motion: OracleMotion
    ) -> tuple[Claim, ...]:
        slower = replace(motion, v=motion.v / 4, speed_ratio=motion.speed_ratio / 4)
        claimed: tuple[Claim, ...] = claims(arm, where, miss, speed, slower)
        return claimed

    monkeypatch.setattr(module, "_claims", of_a_slower_motion)
    for robot, name in KNOWN:
        with pytest.raises(DikbenchError, match=r"peak joint speed .*, must be"):
            make_scenario(_selector(robot, name, 0.01))


@pytest.mark.parametrize(
    ("parameters", "parts"),
    [
        ("robot=panda,singularity=elbow,miss=0", ["miss=0.0 must be 0.002 to 0.05"]),
        ("robot=ur5,miss=0.5", ["miss=0.5 must be 0 or 0.001 to 0.2"]),
        ("robot=talos,singularity=wrist", ["no wrist of robot talos", "auto, elbow"]),
        (
            "robot=planar3r,singularity=wrist",
            ["no wrist of robot planar3r", "valid: singularity=auto"],
        ),
        ("robot=pand", ["unknown robot 'pand'", "'panda'"]),
        ("robot=ur5,speed=5", ["speed=5.0 must be 0.02 to 3"]),
        ("robot=base", ["no singular posture of robot base"]),
        ("robot=planar3r,miss=0", ["no singular posture of robot planar3r", "miss=0.0"]),
        ("robot=kinova,acceleration=true", ["no acceleration limits are known"]),
    ],
)
def test_what_cannot_be_is_one_line(parameters: str, parts: list[str]) -> None:
    """What, where, and what would be valid."""
    message = scenario_error(f"near-miss[{parameters}]")
    for part in parts:
        assert part in message


def test_without_speed_limits_the_distance_says_that_it_is_near(tmp_path: Path) -> None:
    """With limits that are never reached it is not the singularity that is difficult."""
    for speed, situation in (("0", "near singularities"), ("1e9", "free space")):
        limit = f'lower="-3" upper="3" effort="10" velocity="{speed}"'
        arm = write_arm(tmp_path, [replace(joint, limit=limit) for joint in SIX], f"arm{speed}")
        assert make_scenario(f"near-miss[robot={arm},frame=tool]").situation == situation
