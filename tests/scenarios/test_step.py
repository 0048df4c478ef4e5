"""The step: how far and how turned its target is, and what the first command asks for."""

from __future__ import annotations

from typing import Any

import numpy as np
import pinocchio as pin
import pytest
from makers.scenarios import TWENTY_SEEDS, metrics_of, put_robot, scenario_error

from dikbench.errors import DikbenchError
from dikbench.plugins.building import make_scenario
from dikbench.robots.example_robot_data import data_file
from dikbench.robots.kinematics import Kinematics
from dikbench.robots.loading import load_robot
from dikbench.scenario import Scenario
from dikbench.scenario.oracle import solve_placement
from scenarios.step import DIRECTIONS

CORNERS = [(0.05, 0.5), (0.05, 2.62), (0.3, 0.5), (0.3, 2.62)]


def _start(scenario: Scenario) -> Any:
    kinematics = Kinematics(scenario.robot)
    kinematics.update(scenario.q0)
    return kinematics.placement(scenario.robot.frame_id).copy()


@pytest.mark.parametrize(("distance", "angle"), CORNERS)
@pytest.mark.parametrize("robot", DIRECTIONS)
def test_the_target_is_as_far_and_as_turned_as_asked(
    robot: str, distance: float, angle: float
) -> None:
    """In a straight line and about one axis; at the ends of the ranges it can be reached."""
    scenario = make_scenario(f"step[robot={robot},distance={distance},angle={angle}]")
    start, target = _start(scenario), scenario.reference.placement(0.0)
    assert np.linalg.norm(target.translation - start.translation) == pytest.approx(distance)
    assert np.linalg.norm(pin.log3(start.rotation.T @ target.rotation)) == pytest.approx(angle)
    assert np.all(scenario.v0 == 0)
    assert not scenario.reference.moving


@pytest.mark.parametrize("seeds", TWENTY_SEEDS, ids=["few", "many"])
@pytest.mark.parametrize("robot", DIRECTIONS)
def test_the_target_can_be_held_inside_the_limits_from_any_start(robot: str, seeds: range) -> None:
    """For twenty seeds: the posture at the end of the straight way is inside them."""
    for seed in seeds:
        scenario = make_scenario(f"step[robot={robot}]", seed)
        start, target = _start(scenario), scenario.reference.placement(0.0)
        twist, q = pin.log6(start.actInv(target)), scenario.q0
        for share in np.linspace(0.1, 1.0, 10):
            q = solve_placement(scenario.robot, start * pin.exp6(share * twist), q)
        limits = scenario.robot.limits.at(q)
        assert limits.to_lower is not None
        assert limits.to_upper is not None
        assert min(limits.to_lower.min(), limits.to_upper.min()) > 0.05


@pytest.mark.parametrize("robot", DIRECTIONS)
def test_the_first_command_is_too_fast(robot: str) -> None:
    """The gain times J^+ e exceeds a velocity limit, and is what the certificate states."""
    scenario = make_scenario(f"step[robot={robot}]")
    arm, start = scenario.robot, _start(scenario)
    velocity = arm.limits.velocity
    assert velocity is not None
    kinematics = Kinematics(arm)
    kinematics.update(scenario.q0)
    error = pin.log6(start.actInv(scenario.reference.placement(0.0))).np
    v = 5.0 * np.linalg.pinv(kinematics.jacobian(arm.frame_id)) @ error
    ratio = float((np.abs(v) / velocity.upper).max())
    claims = {c.quantity: c.value for c in scenario.certificate.claims}
    assert ratio > 1.1
    # The certificate takes it over the first fiftieth of the way.
    assert claims["first speed over limit"] == pytest.approx(ratio, rel=0.1)


def test_on_a_urdf_the_directions_are_found() -> None:
    """As far and as turned as asked, the same whenever it is made, with room for every seed."""
    arm = f"step[robot={data_file('ur_description/urdf/ur5_robot.urdf')},frame=tool0,distance=0.15]"
    made = [make_scenario(arm, seed) for seed in (0, 0, 1, 2)]
    for scenario in made:
        start, target = _start(scenario), scenario.reference.placement(0.0)
        assert np.linalg.norm(target.translation - start.translation) == pytest.approx(0.15)
        assert np.linalg.norm(pin.log3(start.rotation.T @ target.rotation)) == pytest.approx(1.5)
        assert all(claim.holds for claim in scenario.certificate.claims)
        assert scenario.feasible == "time"
    first, again = (each.reference.placement(0.0).homogeneous for each in made[:2])
    assert np.array_equal(first, again)


def test_clipping_goes_off_course_and_scaling_does_not() -> None:
    """Every law gets there; pinv breaks the limits on the way, clipping bends the way."""
    scenario = make_scenario("step[robot=ur5]")
    free, clipped, scaled = (
        metrics_of(law, scenario) for law in ("pinv", "pinv[after=clip]", "lp-alpha")
    )
    assert free["velocity_violation_max_rad_s"] > 0.5
    assert clipped["velocity_violation_max_rad_s"] < 1e-9
    assert clipped["direction_error_max_rad"] > 0.1
    assert scaled["direction_error_max_rad"] < 1e-6
    for seen in (free, clipped, scaled):
        assert seen["position_error_final_m"] < 1e-6
        assert seen["orientation_error_final_rad"] < 1e-6


def test_a_step_that_asks_for_nothing_is_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    """Joints that are ten times as fast are not tried by it."""
    for robot in ("ur5", "panda"):
        velocity = load_robot(robot).limits.velocity
        assert velocity is not None
        fast = load_robot(robot).with_limits(velocity=20 * velocity.upper)
        put_robot(monkeypatch, fast)
        with pytest.raises(DikbenchError, match="first speed over limit"):
            make_scenario(f"step[robot={robot}]")


@pytest.mark.parametrize(
    ("selector", "words"),
    [
        ("step[distance=0.5]", "distance=0.5 must be 0.05 to 0.3"),
        ("step[angle=3]", "angle=3.0 must be 0.5 to 2.62"),
        ("step[robot=base]", "robot base has no velocity limits"),
        ("step[duration=0]", "duration=0.0 must be finite and above 0"),
    ],
)
def test_errors_say_what_is_valid(selector: str, words: str) -> None:
    """One line each."""
    assert words in scenario_error(selector)
