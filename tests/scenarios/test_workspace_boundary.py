"""The workspace boundary: where it is, that nothing reaches beyond it, and what laws do there."""

from __future__ import annotations

import numpy as np
import pinocchio as pin
import pytest
from makers.problems import with_upper_limit
from makers.scenarios import TWENTY_SEEDS, metrics_of, put_robot, scenario_error

from dikbench.arrays import Array
from dikbench.errors import DikbenchError
from dikbench.plugins.building import make_scenario
from dikbench.robots.robot import Robot
from dikbench.scenario import Range, Scenario
from dikbench.scenario.oracle import solve_placement
from scenarios.workspace_boundary import WorkspaceBoundary


def _claims(scenario: Scenario) -> dict[str, float]:
    return {c.quantity.partition(" ")[0]: c.value for c in scenario.certificate.claims}


def _somewhere(robot: Robot, random: np.random.Generator) -> Array:
    q: Array = pin.integrate(robot.model, pin.neutral(robot.model), random.uniform(-2, 2, robot.nv))
    return q


@pytest.mark.parametrize("robot", WorkspaceBoundary.robots)
def test_nothing_reaches_beyond_the_boundary_and_something_just_before_it(robot: str) -> None:
    """From twenty postures anywhere none does the target at 1.02 of the reach; one does 0.99."""
    scenario = make_scenario(f"workspace-boundary[robot={robot},path=still,extent=1.02]")
    arm, target, random = (
        scenario.robot,
        scenario.reference.placement(0.0),
        np.random.default_rng(0),
    )
    origin = arm.model.jointPlacements[1].translation
    within = pin.SE3(target.rotation, origin + 0.99 / 1.02 * (target.translation - origin))
    for _ in range(20):
        with pytest.raises(DikbenchError, match="no posture found"):
            solve_placement(arm, target, _somewhere(arm, random))
    solve_placement(arm, within, scenario.q0)


def test_the_reach_of_a_planar_arm_is_known_in_closed_form() -> None:
    """Orientation held, the wrist goes to where the first two links are stretched: a circle.

    The wrist w = p - l_3 e(phi) is at 0.7 m from the origin where the ray meets the boundary.
    """
    for seed in range(5):
        scenario = make_scenario("workspace-boundary[robot=planar3r]", seed)
        start = scenario.reference.placement(0.0)
        ray = start.translation / np.linalg.norm(start.translation)
        link = 0.2 * start.rotation[:, 0]
        along = float(ray @ link)
        reach = along + np.sqrt(along**2 - 0.2**2 + 0.7**2)
        assert _claims(scenario)["reach"] == pytest.approx(reach, abs=2e-4)


@pytest.mark.parametrize("seeds", TWENTY_SEEDS, ids=["few", "many"])
@pytest.mark.parametrize("robot", WorkspaceBoundary.robots)
def test_the_boundary_is_singular_and_no_limit_from_any_start(robot: str, seeds: range) -> None:
    """For twenty seeds, as claimed; the motion ends at it, so there is no oracle."""
    for seed in seeds:
        scenario = make_scenario(f"workspace-boundary[robot={robot}]", seed)
        assert scenario.motion is None
        assert scenario.oracle is None
        assert _claims(scenario)["singular"] < 0.01


@pytest.mark.parametrize("extent", [1.0, 1.1, 1.3])
def test_the_path_goes_out_along_the_ray_and_back(extent: float) -> None:
    """From the start to `extent` times the reach and back, orientation held, at the speed given."""
    scenario = make_scenario(f"workspace-boundary[robot=ur5,extent={extent},speed=0.4]")
    reference = scenario.reference
    start, reach = reference.placement(0.0), _claims(scenario)["reach"]
    middle = reference.placement(reference.duration / 2)
    origin = scenario.robot.model.jointPlacements[1].translation
    assert np.linalg.norm(middle.translation - origin) == pytest.approx(extent * reach)
    assert reference.placement(reference.duration).isApprox(start, 1e-9)
    speeds = []
    for share in np.linspace(0.0, 1.0, 101):
        X = reference.placement(share * reference.duration)
        assert np.array_equal(X.rotation, start.rotation)
        across = np.cross(X.translation - origin, start.translation - origin)
        assert np.abs(across).max() < 1e-12
        speeds.append(np.linalg.norm(reference.velocity(share * reference.duration)))
    assert max(speeds) == pytest.approx(0.4, rel=1e-3)
    assert speeds[0] == pytest.approx(0.0, abs=1e-12)


def test_at_the_boundary_the_pseudo_inverse_runs_away_and_others_wait() -> None:
    """Out and back on the Panda: a hundredfold speed, the QP inside the limits and as near."""
    scenario = make_scenario("workspace-boundary[robot=panda]")
    reach = _claims(scenario)["reach"]
    free, kept = metrics_of("pinv", scenario), metrics_of("qp", scenario)
    assert free["velocity_peak_ratio"] > 20
    assert kept["velocity_peak_ratio"] < 1 + 1e-6
    assert kept["position_error_max_m"] < 1.05 * 0.1 * reach
    assert free["position_error_max_m"] > 2 * kept["position_error_max_m"]


def test_out_of_reach_damping_stretches_the_arm_and_stands_still() -> None:
    """A static target: DLS ends at the gap, at rest; pinv keeps thrashing."""
    scenario = make_scenario("workspace-boundary[robot=ur5,path=still]")
    gap = 0.1 * _claims(scenario)["reach"]
    damped, free = metrics_of("dls", scenario), metrics_of("pinv", scenario)
    assert damped["position_error_final_m"] == pytest.approx(gap, rel=0.05)
    assert damped["sigma_min"] < 1e-6
    assert free["joint_travel_rad"] > 20 * damped["joint_travel_rad"]


def test_a_target_within_reach_is_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    """With the range of `extent` out of the way, the certificate says that it is no boundary."""
    monkeypatch.setattr(Range, "check", lambda *given: None)
    for path in ("out-and-back", "still"):
        with pytest.raises(DikbenchError, match="farthest target over the reach"):
            make_scenario(f"workspace-boundary[path={path},extent=0.9]")


def test_a_boundary_that_is_a_limit_is_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    """Where the elbow's limit comes before the stretched arm."""
    put_robot(monkeypatch, with_upper_limit("panda", 3, -0.6))
    with pytest.raises(DikbenchError, match="meets a joint limit at"):
        make_scenario("workspace-boundary")


@pytest.mark.parametrize(
    ("selector", "words"),
    [
        ("workspace-boundary[extent=0.9]", "extent=0.9 must be 1 to 1.5"),
        ("workspace-boundary[speed=0]", "speed=0.0 must be 0.05 to 2"),
        ("workspace-boundary[path=in]", "valid: out-and-back, still"),
        ("workspace-boundary[robot=ur6]", "unknown robot 'ur6'"),
    ],
)
def test_errors_say_what_is_valid(selector: str, words: str) -> None:
    """One line each."""
    assert words in scenario_error(selector)
