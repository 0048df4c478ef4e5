"""The speed sweep: its peak speed, its geometry on any arm, and where it would be no sweep."""

from __future__ import annotations

import numpy as np
import pinocchio as pin
import pytest
from makers.problems import with_upper_limit
from makers.scenarios import TWENTY_SEEDS, metrics_of, put_robot, scenario_error, scenario_of

from dikbench.errors import DikbenchError
from dikbench.plugins.building import make_scenario
from dikbench.robots.kinematics import Kinematics
from scenarios.speed_sweep import SpeedSweep

VARIANTS = [
    f"speed-sweep[robot={robot},path={path}]"
    for robot in SpeedSweep.robots
    for path in ("circle", "lemniscate")
]


@pytest.mark.parametrize("seeds", TWENTY_SEEDS, ids=["few", "many"])
@pytest.mark.parametrize("selector", VARIANTS)
def test_every_arm_sweeps_both_curves_from_twenty_starts(selector: str, seeds: range) -> None:
    """The certificate holds (building asserts it), with the peak speed that was asked for."""
    for seed in seeds:
        motion = scenario_of(selector, seed).motion
        assert motion is not None
        assert motion.peak_speed_ratio == pytest.approx(0.7, rel=0.02)


@pytest.mark.parametrize("selector", VARIANTS)
def test_the_peak_speed_is_that_of_the_pseudo_inverse(selector: str) -> None:
    """Recomputed without the oracle: the largest least-norm velocity on the path over its limit."""
    scenario = scenario_of(selector)
    robot, motion = scenario.robot, scenario.motion
    assert motion is not None
    velocity = robot.limits.velocity
    assert velocity is not None
    kinematics, peak = Kinematics(robot), 0.0
    for tau, q in zip(motion.instants, motion.q, strict=True):
        kinematics.update(q)
        J = kinematics.jacobian(robot.frame_id)
        v = np.linalg.pinv(J) @ scenario.reference.velocity(tau)
        peak = max(peak, float((np.abs(v) / velocity.upper).max()))
    assert peak == pytest.approx(0.7, rel=0.02)


@pytest.mark.parametrize("turn", [0.0, 0.3])
def test_a_planar_arm_stays_in_its_plane(turn: float) -> None:
    """A lemniscate in x-y, the frame turning about z only."""
    scenario = make_scenario(f"speed-sweep[robot=planar3r,path=lemniscate,turn={turn}]")
    start = scenario.reference.placement(0.0)
    angles = []
    for share in np.linspace(0.0, 1.0, 33):
        X = scenario.reference.placement(share * scenario.reference.duration)
        assert X.translation[2] == pytest.approx(0.0, abs=1e-12)
        rotation = pin.log3(X.rotation @ start.rotation.T)
        assert rotation[:2] == pytest.approx(np.zeros(2), abs=1e-9)
        angles.append(rotation[2])
    assert max(angles) == pytest.approx(turn, rel=1e-2)


def test_twice_the_speed_is_half_the_time() -> None:
    """The path is the same, the duration goes with 1/speed."""
    slow, fast = (make_scenario(f"speed-sweep[robot=ur5,speed={s}]") for s in (0.5, 1.0))
    assert slow.reference.duration == pytest.approx(2 * fast.reference.duration)
    for share in (0.2, 0.9):
        a, b = (s.reference.placement(share * s.reference.duration) for s in (slow, fast))
        assert a.homogeneous == pytest.approx(b.homogeneous)


def test_seed_zero_stands_upright_and_another_is_inclined() -> None:
    """By at most 0.2 rad out of the y-z plane."""
    normals = []
    for seed in (0, 1, 2, 3):
        reference = make_scenario("speed-sweep[robot=ur5]", seed).reference
        a, b, c = (reference.placement(k / 6 * reference.duration).translation for k in range(3))
        normal = np.cross(b - a, c - a)
        normals.append(normal / np.linalg.norm(normal))
    assert normals[0] == pytest.approx(np.array([1.0, 0.0, 0.0]), abs=1e-9)
    angles = [np.arccos(normal[0]) for normal in normals[1:]]
    assert 1e-3 < min(angles)
    assert max(angles) <= 0.2


def test_beyond_the_limits_the_pseudo_inverse_breaks_them_and_scaling_falls_behind() -> None:
    """At 1.3 times: the one is 30 % too fast, the other makes less than was asked for."""
    scenario = make_scenario("speed-sweep[robot=ur5,path=lemniscate,turn=0.3,speed=1.3]")
    assert metrics_of("pinv", scenario)["velocity_peak_ratio"] == pytest.approx(1.3, rel=0.03)
    scaled = metrics_of("lp-alpha", scenario)
    assert scaled["velocity_peak_ratio"] < 1 + 1e-6
    assert scaled["progress_mean"] < 0.99


def test_below_the_limits_every_law_follows() -> None:
    """At 0.7 times nothing is left behind, but for what a step of 2 ms cannot follow."""
    scenario = make_scenario("speed-sweep[robot=ur5,path=lemniscate,turn=0.3,dt=0.002,laps=1]")
    for law in ("pinv", "pinv[after=clip]", "qp", "lp-alpha"):
        assert metrics_of(law, scenario)["position_error_max_m"] < 1e-3


def test_a_sweep_into_a_limit_is_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    """Where a joint would meet its limit on the curve the case would be another one."""
    put_robot(monkeypatch, with_upper_limit("ur5", 2, 1.42))
    with pytest.raises(DikbenchError, match="position margin"):
        make_scenario("speed-sweep[robot=ur5]")


@pytest.mark.parametrize(
    ("selector", "words"),
    [
        ("speed-sweep[path=square]", "valid: circle, lemniscate"),
        ("speed-sweep[turn=1]", "turn=1.0 must be 0 to 0.5"),
        ("speed-sweep[laps=6]", "laps=6.0 must be 1 to 5"),
        ("speed-sweep[speed=4]", "speed=4.0 must be 0.1 to 3"),
        ("speed-sweep[robot=ur3,radius=0.15]", "robot ur3: no posture found"),
    ],
)
def test_errors_say_what_is_valid(selector: str, words: str) -> None:
    """One line each."""
    assert words in scenario_error(selector)
