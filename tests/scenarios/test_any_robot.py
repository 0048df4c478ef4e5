"""Robots that no family knows: what a URDF can do is what the page of scenarios says."""

from __future__ import annotations

import re
import time
from functools import lru_cache
from pathlib import Path
from typing import Any

import numpy as np
import pinocchio as pin
import pytest
from makers.scenarios import metrics_of, scenario_error
from makers.urdf_arms import write_urdf

from dikbench.arrays import Array
from dikbench.plugins.building import make_family, make_scenario
from dikbench.plugins.finding import plugins
from dikbench.problem.constraints import CollisionConstraint
from dikbench.robots.catalogue import ROBOTS
from dikbench.robots.kinematics import Kinematics
from dikbench.robots.loading import load_robot
from dikbench.robots.robot import Robot
from dikbench.scenario.family import certified_robots
from dikbench.scenario.named_robots import NamedRobotFamily
from scenarios import SCENARIOS

PAGE = Path(__file__).parents[2] / "docs" / "reference" / "scenarios.md"
NAMED = [name for name, family in SCENARIOS.items() if issubclass(family, NamedRobotFamily)]


@lru_cache
def _table() -> dict[str, str]:
    """Read the last column of the page's table of families, by family."""
    lines = PAGE.read_text(encoding="utf-8").splitlines()
    return {
        match[1]: line.rstrip(" |").rpartition("|")[2].strip()
        for line in lines
        if (match := re.match(r"\| `([a-z-]+)` \|", line))
    }


@pytest.fixture(scope="module")
def arm(tmp_path_factory: pytest.TempPathFactory) -> str:
    """An arm with six joints, all limits and collision geometry."""
    return write_urdf(tmp_path_factory.mktemp("arm") / "arm.urdf", radius=0.05)


def _at(arm: str, *parameters: str) -> str:
    return ",".join((f"[robot={arm},frame=tool", *parameters)) + "]"


def _placement(robot: Robot, q: Array) -> Any:
    kinematics = Kinematics(robot)
    kinematics.update(q)
    return kinematics.placement(robot.frame_id).copy()


def _sigma(robot: Robot, q: Array) -> float:
    """Compute the smallest singular value of the Jacobian, from central differences."""
    columns = []
    for direction in 1e-6 * np.eye(robot.nv)[robot.chain]:
        ahead, behind = (
            _placement(robot, pin.integrate(robot.model, q, side * direction)) for side in (1, -1)
        )
        columns.append(pin.log6(behind.actInv(ahead)).np / 2e-6)
    return float(np.linalg.svd(np.array(columns), compute_uv=False)[-1])


def _margins(robot: Robot, q: Array) -> Array:
    position = robot.limits.position
    assert position is not None
    return np.minimum(position.upper - q, q - position.lower)


# --- the page's table


def test_the_table_has_every_family() -> None:
    """And no other."""
    assert set(_table()) == set(plugins("scenario"))


@pytest.mark.parametrize("name", plugins("scenario"))
def test_the_table_names_the_robots_that_are_certified(name: str) -> None:
    """All of them, or how many they are."""
    cell, certified = _table()[name], certified_robots(SCENARIOS[name])
    named = [word for word in re.findall(r"[a-z0-9-]+", cell) if word in ROBOTS]
    count = re.search(r"(\d+) (?:arms|robots)", cell)
    assert count or named or cell.startswith("any robot")
    if named:
        assert set(named) == set(certified)
    if count:
        assert int(count[1]) == len(certified)


@pytest.mark.parametrize("name", plugins("scenario"))
def test_the_table_says_who_takes_a_urdf(name: str, arm: str, tmp_path: Path) -> None:
    """A small arm of six joints certifies where it says so, and is refused where it does not."""
    given = ""
    if name == "csv":
        start = load_robot(arm, "tool")
        X = _placement(start, start.q0)
        turned = pin.Quaternion(X.rotation).coeffs().tolist()
        x, y, z = X.translation
        rows = [(k, x + 0.01 * k, y, z, *turned) for k in range(4)]
        file = tmp_path / "poses.csv"
        lines = ["t,x,y,z,qx,qy,qz,qw", *(",".join(map(str, row)) for row in rows)]
        file.write_text("\n".join(lines))
        given = f"file={file}"
    selector = name + _at(arm, *filter(None, [given]))
    if "any URDF" in _table()[name]:
        assert make_scenario(selector).robot.name == "arm"
    else:
        assert "valid: " in scenario_error(selector)


# --- families that take any robot


@pytest.mark.parametrize("seed", range(4))
def test_a_step_is_as_far_and_as_turned_as_asked_and_free(seed: int, arm: str) -> None:
    """And each posture of the straight way, found anew, is inside the limits."""
    scenario = make_scenario("step" + _at(arm, "distance=0.15", "angle=1.2"), seed)
    robot, q = scenario.robot, scenario.q0
    start, target = _placement(robot, q), scenario.reference.placement(0.0)
    assert np.linalg.norm(target.translation - start.translation) == pytest.approx(0.15)
    assert np.linalg.norm(pin.log3(start.rotation.T @ target.rotation)) == pytest.approx(1.2)
    for _ in range(300):  # the screw in small steps, by the inverse of the Jacobian
        kinematics = Kinematics(robot)
        kinematics.update(q)
        error = pin.log6(kinematics.placement(robot.frame_id).actInv(target)).np
        v = np.linalg.solve(kinematics.jacobian(robot.frame_id), error)
        q = pin.integrate(robot.model, q, 0.03 * v)
        assert _margins(robot, q).min() > 0
    assert np.linalg.norm(error) < 1e-3


@pytest.mark.parametrize("rows", ["xyz", "rxryrz", "world:xy", "world:zrz"])
def test_a_step_asks_for_something_in_each_of_its_rows(rows: str, arm: str) -> None:
    """In the frame's axes or the world's: whatever it leaves out is as at the start."""
    scenario = make_scenario("step" + _at(arm, f"rows={rows}", "distance=0.3", "angle=2.5"))
    start, target = _placement(scenario.robot, scenario.q0), scenario.reference.placement(0.0)
    moved, turned = (
        target.translation - start.translation,
        pin.log3(target.rotation @ start.rotation.T),
    )
    if not rows.startswith("world:"):
        moved, turned = start.rotation.T @ moved, start.rotation.T @ turned
    names = re.findall("r?[xyz]", rows.removeprefix("world:"))
    for axis, name in enumerate("xyz"):
        assert name in names or abs(moved[axis]) < 1e-9
        assert "r" + name in names or abs(turned[axis]) < 1e-9
    assert np.linalg.norm(moved) == pytest.approx(0.3 if set("xyz") & set(names) else 0.0)
    assert np.linalg.norm(turned) == pytest.approx(2.5 if "rz" in names else 0.0)


@pytest.mark.parametrize("posture", ["start", "singular", "limit"])
def test_it_stands_still_where_it_says(posture: str, arm: str) -> None:
    """Next to a singularity, by differences of placements; next to one limit; or to neither."""
    for seed in range(4):
        scenario = make_scenario("hold-still" + _at(arm, f"posture={posture}"), seed)
        sigma, margins = _sigma(scenario.robot, scenario.q0), _margins(scenario.robot, scenario.q0)
        assert (1e-4 < sigma < 2e-3) == (posture == "singular")
        assert (abs(margins.min() - 0.003) < 1e-6) == (posture == "limit")
        assert np.sort(margins)[1] > 0.04
        wanted = scenario.reference.placement(4.0).homogeneous
        assert _placement(scenario.robot, scenario.q0).homogeneous == pytest.approx(wanted)


@pytest.mark.parametrize("seed", [0, 2])
def test_the_sweep_is_about_the_start(seed: int, arm: str) -> None:
    """Half way it is the start's placement (turned by the seed); its twist is its derivative."""
    scenario = make_scenario("back-and-forth" + _at(arm), seed)
    robot, reference = scenario.robot, scenario.reference
    pace = reference.duration / 10.0
    middle, start = reference.placement(pace * np.pi / 4), _placement(robot, robot.q0)
    assert middle.homogeneous == pytest.approx(start.homogeneous, abs=1e-9)
    first, last = reference.placement(0.0), reference.placement(pace * np.pi / 2)
    scale = next(c.value for c in scenario.certificate.claims if c.quantity == "scale of the path")
    across = last.translation - first.translation
    assert np.linalg.norm(across) == pytest.approx(scale * np.linalg.norm([0.8, 0.2, 0.2]))
    assert across[2] == pytest.approx(0.2 * scale)
    for tau in (0.3, 1.9, 8.1):
        before, after = reference.placement(tau - 1e-5), reference.placement(tau + 1e-5)
        twist = pin.log6(before.actInv(after)).np / 2e-5
        assert reference.velocity(tau) == pytest.approx(twist, abs=1e-8)
    assert scenario.motion is not None
    assert scenario.motion.peak_speed_ratio <= 1.0
    assert min(_margins(robot, q).min() for q in scenario.motion.q) > 0


def test_a_slow_arm_sweeps_less(tmp_path: Path) -> None:
    """The largest that it can do within its speed limits."""
    scales = []
    for velocity in (3.0, 0.3):
        slow = write_urdf(tmp_path / "slow.urdf", velocity=velocity)
        claims = make_scenario("back-and-forth" + _at(slow)).certificate.claims
        scales.append(next(c.value for c in claims if c.quantity == "scale of the path"))
    assert 0.05 <= scales[1] < 0.8 * scales[0]


def test_a_planar_arm_sweeps_in_its_plane() -> None:
    """Neither its height nor its tilt changes."""
    reference = make_scenario("back-and-forth[robot=planar4r]").reference
    for tau in np.linspace(0.0, reference.duration, 9):
        X = reference.placement(tau)
        assert abs(X.translation[2]) < 1e-12
        assert X.rotation[2] == pytest.approx([0.0, 0.0, 1.0])


@pytest.mark.parametrize("seed", [0, 3])
def test_an_arm_folds_into_itself_half_way(seed: int, arm: str) -> None:
    """Two spheres of a link each are nearer to each other than their radii, and start apart."""
    scenario = make_scenario("self-collision" + _at(arm), seed)
    (constraint,) = scenario.constraints
    assert isinstance(constraint, CollisionConstraint)
    assert scenario.motion is not None
    robot, q = scenario.robot, scenario.motion.q
    data, apart = robot.model.createData(), []

    def centre(body: str) -> Array:
        link, _, number = body.rpartition("_")
        joint = 0 if link == "base" else int(link.removeprefix("link")) + 1
        where: Array = data.oMi[joint].act(np.array([0.0, 0.0, 0.1 * int(number)]))
        return where

    for sample in (q[0], q[len(q) // 2], q[-1]):
        pin.forwardKinematics(robot.model, data, sample)
        pairs = constraint.pairs(robot).names
        apart.append(min(np.linalg.norm(centre(a) - centre(b)) - 0.1 for a, b in pairs))
    assert min(apart[0], apart[2]) > constraint.margin
    assert -0.1 <= apart[1] <= -0.02


# --- what forbids it


@pytest.mark.parametrize("name", ["step", "speed-sweep", "pick-and-place", "self-collision"])
def test_without_velocity_limits_it_says_so(name: str, tmp_path: Path) -> None:
    """And takes those that are given by hand."""
    free = write_urdf(tmp_path / "free.urdf", velocity=0.0, radius=0.05)
    message = scenario_error(name + _at(free))
    assert "robot free has no velocity limits, from which the " in message
    assert "give velocity=" in message
    assert make_scenario(name + _at(free, "velocity=2"))


@pytest.mark.parametrize("name", ["speed-sweep", "pick-and-place"])
def test_a_motion_of_a_few_control_periods_is_refused(name: str, tmp_path: Path) -> None:
    """By a line that names the speed and dt; a smaller dt does it."""
    fast = write_urdf(tmp_path / "fast.urdf", velocity=100.0)
    message = scenario_error(name + _at(fast))
    assert "at speed=0." in message
    assert "control periods of dt=0.01 s, too few" in message
    assert make_scenario(name + _at(fast, "dt=0.0002"))


def test_without_effort_limits_or_bodies_it_says_so(tmp_path: Path) -> None:
    """What the URDF lacks."""
    bare = write_urdf(tmp_path / "bare.urdf", effort=0.0)
    assert "robot bare: the URDF has no effort limits" in scenario_error(
        "torque-limited" + _at(bare)
    )
    assert "robot bare: the URDF has no collision geometry" in scenario_error(
        "self-collision" + _at(bare)
    )


def test_where_nothing_is_found_the_last_attempt_is_told(tmp_path: Path) -> None:
    """Of steps for which the joints are too fast, of a sweep of a frame that is at its joint."""
    fast = write_urdf(tmp_path / "fast.urdf", velocity=100.0)
    message = scenario_error("step" + _at(fast))
    assert "no step of distance=0.2, angle=1.5" in message
    assert "first speed over limit = 0." in message
    assert "scale of the path = 0, must be" in scenario_error("back-and-forth[robot=base]")
    assert "no joint has a limit" in scenario_error("hold-still[robot=base,posture=limit]")


@pytest.mark.parametrize("name", NAMED)
def test_families_of_known_postures_take_no_other_rows_or_joints(name: str) -> None:
    """They are not shown either."""
    for given in ("rows=xyz", "lock=joint1", "root=free", "frame=tool"):
        assert f"{given.partition('=')[0]}='" in scenario_error(f"{name}[{given}]")
    parameters = plugins("scenario")[name].parameters
    assert all(parameters[each].hidden for each in ("frame", "rows", "lock", "root"))
    assert make_family(name)


@pytest.mark.parametrize("given", ["lock=panda_joint3", "rows=xyz", "frame=panda_link8"])
@pytest.mark.parametrize("name", ["step", "hold-still", "self-collision", "near-miss"])
def test_a_known_arm_with_other_joints_rows_or_frame(name: str, given: str) -> None:
    """Its known postures are not meant: it certifies as any other robot does."""
    extra = ",distance=0.3" if name == "step" else ""
    scenario = make_scenario(f"{name}[robot=panda,{given}{extra}]")
    assert all(claim.holds for claim in scenario.certificate.claims)


# --- slow arms, and joints elsewhere


def test_reach_gives_a_slow_arm_a_lower_gain_and_more_time(tmp_path: Path) -> None:
    """By as much: it arrives as well, inside its speed limits; a gain that is given is kept."""
    brisk = write_urdf(tmp_path / "brisk.urdf", velocity=3.0)
    slow = write_urdf(tmp_path / "slow.urdf", velocity=0.2)
    fast, late = (make_scenario("reach" + _at(each)) for each in (brisk, slow))
    assert (fast.tracking.gain, fast.duration) == (2.0, 2.5)
    assert 0.2 < late.tracking.gain < 1.9
    assert late.tracking.gain * late.duration == pytest.approx(5.0)
    seen = metrics_of("pinv", late)
    assert seen["velocity_peak_ratio"] <= 1.0
    assert seen["position_error_final_m"] < 2e-3
    assert "required speed over limit" in scenario_error("reach" + _at(slow, "gain=2.5"))
    slower = write_urdf(tmp_path / "slower.urdf", velocity=0.01)
    assert "gain over the default = 0.0" in scenario_error("reach" + _at(slower))


def test_joints_elsewhere_change_nothing_and_cost_little(tmp_path: Path) -> None:
    """Of a hundred joints, 94 do not move the frame: the same near miss as without them."""
    few, many = (
        write_urdf(tmp_path / f"arm{elsewhere}.urdf", elsewhere=elsewhere) for elsewhere in (0, 94)
    )
    start = load_robot(few, "tool").q0
    assert load_robot(many, "tool").nv == 100
    began = time.process_time()
    wide = make_scenario("near-miss" + _at(many))
    assert time.process_time() - began < 10.0
    resting = np.setdiff1d(np.arange(100), wide.robot.chain)
    assert wide.motion is not None
    assert np.ptp(wide.motion.q[:, resting], axis=0).max() == 0.0
    assert all(claim.holds for claim in wide.certificate.claims)
    assert len(start) == len(wide.robot.chain)


def test_a_random_path_says_that_a_joint_has_no_room(tmp_path: Path) -> None:
    """Between limits nearer than two margins it stays in the middle: the certificate tells it."""
    file = Path(write_urdf(tmp_path / "narrow.urdf"))
    first = 'lower="-2.8" upper="2.8"'
    file.write_text(file.read_text().replace(first, 'lower="-0.05" upper="0.07"', 1))
    said = scenario_error(f"random-joint-path[robot={file},frame=tool]")
    assert "position margin [rad] = 0.06, must be >= 0.099" in said
