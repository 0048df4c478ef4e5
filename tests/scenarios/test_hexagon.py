"""Flacco's hexagon: its corners, its constant speed, and what only the null space can keep."""

from __future__ import annotations

import numpy as np
import pytest
from makers.scenarios import TWENTY_SEEDS, metrics_of, put_robot, scenario_error

from dikbench.arrays import Array
from dikbench.errors import DikbenchError
from dikbench.plugins.building import make_scenario
from dikbench.robots.kinematics import Kinematics
from dikbench.robots.loading import load_robot
from dikbench.robots.robot import Robot
from dikbench.scenario import Scenario

PUBLISHED = ("lwr", "planar4r")
ROBOTS = (*PUBLISHED, "panda", "xarm7", "tiago")

# In the order in which they are visited, as published, about the centre [m].
CORNERS = {
    "lwr": np.array([0.1, 0.35, 0.6235])
    + np.array(
        [
            [0, 0, 2],
            [0, 3**0.5, 1],
            [0, 3**0.5, -1],
            [0, 0, -2],
            [0, -(3**0.5), -1],
            [0, -(3**0.5), 1],
        ]
    )
    / 10,
    "planar4r": np.array([0.7, 0.0, 0.0])
    + np.array(
        [
            [0, 2, 0],
            [3**0.5, 1, 0],
            [3**0.5, -1, 0],
            [0, -2, 0],
            [-(3**0.5), -1, 0],
            [-(3**0.5), 1, 0],
        ]
    )
    / 10,
}


def _position(robot: Robot, q: Array) -> Array:
    kinematics = Kinematics(robot)
    kinematics.update(q)
    point: Array = kinematics.placement(robot.frame_id).translation.copy()
    return point


def _way_to_the_top(scenario: Scenario) -> float:
    top = CORNERS[scenario.robot.name][0]
    return float(np.linalg.norm(top - _position(scenario.robot, scenario.q0)))


@pytest.mark.parametrize("robot", PUBLISHED)
def test_it_starts_as_published_and_visits_the_corners_in_order(robot: str) -> None:
    """Each 0.2 m after the other, twice round, and ends where it closes."""
    scenario = make_scenario(f"hexagon[robot={robot},speed=0.4]")
    start = {"lwr": (0, 45, 45, 45, 0, 0, 0), "planar4r": (0, 90, -90, 90)}[robot]
    assert scenario.q0 == pytest.approx(np.deg2rad(start))
    first = _way_to_the_top(scenario) / 0.4
    for k in range(13):
        corner = scenario.reference.placement(first + k * 0.2 / 0.4).translation
        assert corner == pytest.approx(CORNERS[robot][k % 6], abs=1e-9)
    assert scenario.reference.duration == pytest.approx(first + 12 * 0.2 / 0.4)


@pytest.mark.parametrize("robot", ROBOTS)
def test_the_speed_along_the_path_never_changes(robot: str) -> None:
    """On the first line and on every side; the orientation stays."""
    scenario = make_scenario(f"hexagon[robot={robot},speed=0.4]")
    for share in np.linspace(0.003, 0.997, 83):
        twist = scenario.reference.velocity(share * scenario.reference.duration)
        assert np.linalg.norm(twist[:3]) == pytest.approx(0.4)
        assert np.abs(twist[3:]).max() < 1e-12


@pytest.mark.parametrize("robot", ROBOTS)
def test_only_the_position_is_tracked_and_the_start_moves_along(robot: str) -> None:
    """J v0 is the path's own velocity in the tracked rows, slower where that is too fast."""
    scenario = make_scenario(f"hexagon[robot={robot},speed=0.05]")
    assert scenario.rows == ((0, 1) if robot == "planar4r" else (0, 1, 2))
    kinematics = Kinematics(scenario.robot)
    kinematics.update(scenario.q0)
    rows = list(scenario.rows)
    made = kinematics.jacobian(scenario.robot.frame_id)[rows] @ scenario.v0
    assert made == pytest.approx(scenario.reference.velocity(0.0)[rows], abs=1e-9)


@pytest.mark.parametrize("seeds", TWENTY_SEEDS, ids=["few", "many"])
@pytest.mark.parametrize("robot", ROBOTS)
def test_the_least_norm_motion_leaves_the_range_from_any_start(robot: str, seeds: range) -> None:
    """Recomputed from its configurations, for twenty seeds; speed goes with the speed asked for."""
    for seed in seeds:
        scenario = make_scenario(f"hexagon[robot={robot}]", seed)
        motion, position = scenario.motion, scenario.robot.limits.position
        assert motion is not None
        assert position is not None
        assert np.maximum(motion.q - position.upper, position.lower - motion.q).max() > 0.1
        assert np.all(scenario.q0 < position.upper)
        assert np.all(scenario.q0 > position.lower)
        for tau, q in zip(motion.instants[::20], motion.q[::20], strict=True):
            on_path = scenario.reference.placement(tau).translation
            assert _position(scenario.robot, q) == pytest.approx(on_path, abs=1e-8)


def test_the_null_space_keeps_limits_that_the_least_norm_motion_breaks() -> None:
    """On the planar arm, slowly: the QP follows as well, inside the range; pinv leaves it."""
    scenario = make_scenario("hexagon[robot=planar4r,speed=0.3,dt=0.005,laps=1]")
    free, kept = metrics_of("pinv", scenario), metrics_of("qp", scenario)
    assert free["position_violation_max_rad"] > 0.15
    assert kept["position_violation_max_rad"] < 1e-6
    assert kept["position_error_rms_m"] < 1.1 * free["position_error_rms_m"]


def test_where_no_motion_is_fast_enough_laws_clip_or_fall_behind() -> None:
    """The LWR at 0.5 m/s: pinv is 4 times too fast, scaling slows down, the QP goes off course."""
    scenario = make_scenario("hexagon[robot=lwr,dt=0.005,laps=1]")
    assert metrics_of("pinv", scenario)["velocity_peak_ratio"] > 4
    scaled, kept = metrics_of("lp-alpha", scenario), metrics_of("qp", scenario)
    assert scaled["progress_min"] < 0.5
    assert scaled["direction_error_max_rad"] < 1e-6
    assert kept["direction_error_max_rad"] > 0.3
    assert max(scaled["position_violation_max_rad"], kept["position_violation_max_rad"]) < 1e-6


@pytest.mark.parametrize(
    ("limits", "words"),
    [
        ({"position": (-6.0, 6.0)}, "margin of the least-norm motion"),
        ({"velocity": 20.0}, "required speed over limit"),
    ],
)
def test_limits_that_it_does_not_reach_are_refused(
    limits: dict[str, object], words: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    """With a wider range, or faster joints, the hexagon is no test of them."""
    for robot in ROBOTS:
        put_robot(monkeypatch, load_robot(robot).with_limits(**limits))
        with pytest.raises(DikbenchError, match=words):
            make_scenario(f"hexagon[robot={robot}]")


@pytest.mark.parametrize(
    ("selector", "words"),
    [
        ("hexagon[robot=ur5]", f"valid: {', '.join(ROBOTS)}"),
        ("hexagon[speed=3]", "speed=3.0 must be 0.05 to 2"),
        ("hexagon[laps=0]", "laps=0 must be 1 to 5"),
        ("hexagon[dt=0]", "dt=0.0 must be finite and above 0"),
    ],
)
def test_errors_say_what_is_valid(selector: str, words: str) -> None:
    """One line each."""
    assert words in scenario_error(selector)
