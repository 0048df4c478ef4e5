"""A user's own poses: followed as they are, by any robot, or refused by the line that is wrong."""

from __future__ import annotations

import importlib.metadata
import re
from decimal import Decimal
from pathlib import Path

import numpy as np
import pinocchio as pin
import pytest
from makers.problems import with_upper_limit
from makers.scenarios import Recording, metrics_of, put_robot, scenario_error

from dikbench.errors import DikbenchError
from dikbench.metrics import evaluate, motion_of
from dikbench.plugins.building import make_scenario
from dikbench.robots.kinematics import Kinematics
from dikbench.robots.loading import load_robot
from dikbench.scenario import Scenario, placement_of, read_poses, solve_placement
from dikbench.scenario.plant import Ideal
from dikbench.simulation.closed_loop import simulate
from dikbench.solvers.checked_solve import make_solve
from scenarios.streams import make_teleoperation

DATA = Path(__file__).parents[1] / "data"
TRIANGLE = DATA / "triangle.csv"
HEADER = "t,x,y,z,qx,qy,qz,qw"
OUT_OF_REACH = "the pose or the path to it is out of reach of robot panda"


def _rows(path: Path) -> np.ndarray:
    return np.loadtxt(path, delimiter=",", skiprows=1)


@pytest.mark.parametrize("robot", ["panda", "ur5", "xarm7", "kinova"])
def test_the_example_is_followed_from_its_first_row_to_its_last(robot: str) -> None:
    """Every row is passed at its time, and the oracle is there too."""
    scenario = make_scenario(f"csv[robot={robot},file={TRIANGLE}]")
    rows = _rows(TRIANGLE)
    assert scenario.reference.duration == rows[-1, 0]
    for row in rows:
        X = scenario.reference.placement(row[0])
        assert X.translation == pytest.approx(row[1:4])
        quaternion = pin.Quaternion(*row[[7, 4, 5, 6]]).normalized()
        assert X.rotation == pytest.approx(quaternion.matrix(), abs=1e-9)
    oracle, kinematics = scenario.oracle, Kinematics(scenario.robot)
    assert oracle is not None
    for k in (0, scenario.steps // 2, scenario.steps):
        kinematics.update(oracle[k])
        X = kinematics.placement(scenario.robot.frame_id)
        wanted = scenario.reference.placement(k * scenario.dt).homogeneous
        assert X.homogeneous == pytest.approx(wanted, abs=1e-8)


def test_joined_by_screws_the_target_moves_at_constant_speed_between_two_rows() -> None:
    """And rests where two rows are the same."""
    reference = make_scenario(f"csv[file={TRIANGLE},joined=screw]").reference
    first = reference.velocity(0.1)
    assert reference.velocity(0.9) == pytest.approx(first)
    assert pin.log6(reference.placement(0.0).actInv(reference.placement(1.0))).np == pytest.approx(
        first
    )
    assert np.abs(reference.velocity(2.2)).max() < 1e-12


def _weld(path: Path, period: float, origin: str = "0") -> str:
    """Write a weave across a line, of 1 s, as a UR10 does it, and return its selector."""
    arm = load_robot("ur10")
    start, lines = placement_of(arm, arm.q0), [HEADER]
    for k in range(round(1 / period) + 1):
        t, w = k * period, 3 * np.pi
        X = start * pin.SE3(
            pin.exp3(np.array([0.1 * np.sin(w * t / 2), 0.0, 0.2 * np.sin(w * t / 3)])),
            np.array([0.06 * t, 0.02 * np.sin(w * t), 0.01 * np.cos(w * t)]),
        )
        numbers = [*X.translation, *pin.Quaternion(X.rotation).coeffs()]
        stamp = Decimal(origin) + k * Decimal(str(period))
        lines.append(",".join([f"{stamp:f}", *(f"{number:.9f}" for number in numbers)]))
    path.write_text("\n".join(lines), encoding="utf-8")
    return f"csv[robot=ur10,file={path},acceleration=true,dt=0.002]"


def _claims(scenario: Scenario) -> dict[str, tuple[int, float]]:
    """What a certificate says: by quantity, the line of the file and the value."""
    said = [re.match(r"(.*), at line (\d+)(.*)", c.quantity) for c in scenario.certificate.claims]
    values = [claim.value for claim in scenario.certificate.claims]
    return {
        found[1] + found[3]: (int(found[2]), value)
        for found, value in zip(said, values, strict=True)
        if found
    }


def test_a_path_is_the_same_task_however_often_it_is_sampled(tmp_path: Path) -> None:
    """Every 20 ms or every 2 ms: the same accelerations and infeasible steps, the same verdict."""
    asked, shares = [], []
    for period in (0.02, 0.002):
        scenario = make_scenario(_weld(tmp_path / f"{period}.csv", period))
        assert scenario.feasible == "time"
        asked.append(_claims(scenario)["required joint acceleration over limit"][1])
        shares.append(metrics_of("lp-alpha", scenario)["feasible_share"])
    assert asked[0] == pytest.approx(asked[1], rel=0.03)
    assert shares[0] == pytest.approx(shares[1], abs=0.005)


def test_metrics_are_the_same_whatever_clock_stamped_the_rows(tmp_path: Path) -> None:
    """From 0, and from the seconds of 2023: every metric to 1e-7 of itself."""
    first, second = (
        metrics_of("pinv", make_scenario(_weld(tmp_path / "weld.csv", 0.02, origin)))
        for origin in ("0", "1700000000.123456789")
    )
    for name, value in first.items():
        assert second[name] == pytest.approx(value, rel=1e-7, nan_ok=True), name


def test_the_certificate_says_what_a_file_asks_for_and_at_which_line(tmp_path: Path) -> None:
    """A jump of 0.1 m in 20 ms, from line 25 to line 26, whatever joins the rows."""
    path = tmp_path / "jump.csv"
    rows = [f"{k / 50},{0.3 + 0.1 * (k >= 24)},0,0.5,1,0,0,0" for k in range(50)]
    path.write_text("\n".join([HEADER, *rows]), encoding="utf-8")
    for joined in ("smooth", "screw"):
        scenario = make_scenario(f"csv[file={path},joined={joined}]")
        said = _claims(scenario)
        line, speed = said["fastest target between two rows [m/s]"]
        assert (line, speed) == pytest.approx((26, 5.0))
        line, ratio = said["required joint speed over limit"]
        assert (line, ratio > 2) == (26, True)
        line, ratio = said["required joint acceleration over limit"]
        assert (line in (25, 26, 27), ratio > 10) == (True, True)
        assert scenario.feasible == "path"
    said = _claims(make_scenario(f"csv[file={path},joined=hold]"))
    assert said["largest step of the target [m]"] == pytest.approx((26, 0.1))


def test_rows_nanoseconds_apart_are_refused_unless_they_are_held() -> None:
    """13 mm in 1 ns: no target moves so; as a stream it is a step."""
    file = DATA / "poses" / "tiny_dt.csv"
    for joined in ("smooth", "screw"):
        error = scenario_error(f"csv[robot=ur10,file={file},joined={joined}]")
        assert f"{file}, line 12: the target moves 0.0126 m within 1e-09 s" in error
        assert "valid: up to 100 m/s, or joined=hold" in error
    scenario = make_scenario(f"csv[robot=ur10,file={file},joined=hold]")
    assert _claims(scenario)["largest step of the target [m]"][1] == pytest.approx(0.0126, abs=1e-4)
    assert metrics_of("dls", scenario)["position_error_max_m"] < 0.05


def test_times_in_nanoseconds_are_refused() -> None:
    """With the unit that is expected."""
    error = scenario_error(f"csv[robot=ur10,file={DATA / 'poses' / 'nanosec.csv'}]")
    assert "nanosec.csv, with t in seconds: a run of 4e+09 s" in error


def test_an_arm_of_five_joints_follows_the_positions_of_its_own_recorded_poses() -> None:
    """Between the rows no posture of it has the orientation, which it is told of."""
    selector = (
        f"csv[robot={DATA / 'urdf' / 'five_dof.urdf'},frame=tool,velocity=2,"
        f"file={DATA / 'poses' / 'five_dof_own_101.csv'}"
    )
    error = scenario_error(f"{selector}]")
    assert "frame tool is moved by 5 joints, a pose has 6 rows: give rows=..." in error
    scenario = make_scenario(f"{selector},rows=xyz]")
    assert metrics_of("pinv", scenario)["position_error_max_m"] < 3e-3


def test_a_held_target_steps_from_row_to_row() -> None:
    """Without a velocity, each until the time of the next one."""
    scenario = make_scenario(f"csv[file={TRIANGLE},joined=hold]")
    X = scenario.reference.placement
    assert X(0.999).translation == pytest.approx([0.31, 0.0, 0.49])
    assert X(1.0).translation == pytest.approx([0.41, -0.1, 0.49])
    assert not any(np.any(V.np) for _, V in scenario.targets)


def test_the_start_is_near_the_posture_that_is_asked_for(tmp_path: Path) -> None:
    """The elbow below the shoulder, on the same first pose, to the digits of the file."""
    file, arm = tmp_path / "weld.csv", load_robot("ur10")
    selector = _weld(file, 0.02)
    other = np.array([0.3, 0.1, -1.4, -1.7, -1.4, 0.2])
    above = make_scenario(selector)
    below = make_scenario(f"{selector[:-1]},q0={' '.join(map(str, other))}]")
    assert above.q0 == pytest.approx(solve_placement(arm, above.reference.placement(0), arm.q0))
    assert above.q0[2] > 0.5
    assert below.q0[2] < -0.5
    kinematics = Kinematics(arm)
    kinematics.update(below.q0)
    X = kinematics.placement(arm.frame_id)
    assert X.homogeneous == pytest.approx(above.reference.placement(0).homogeneous, abs=1e-8)


def test_the_shipped_stream_is_what_its_generator_writes() -> None:
    """With the jitter, bursts and gaps that it says."""
    written = make_teleoperation.FILE.read_text(encoding="utf-8")
    assert written.splitlines() == make_teleoperation.lines()
    spans = np.diff(read_poses(str(make_teleoperation.FILE)).times)
    assert np.median(spans) == pytest.approx(1 / 30, abs=1e-3)
    assert spans.min() < 1e-3
    assert (spans > 0.25).sum() == 2


@pytest.mark.parametrize("joined", ["smooth", "hold"])
def test_a_stream_is_followed_as_it_is(joined: str) -> None:
    """By `qp` within its limits, without a freeze; held, the target waits in the gaps."""
    scenario = make_scenario(f"csv[file=teleoperation,joined={joined},gain=20]")
    got = metrics_of("qp", scenario)
    assert got["freeze_events"] == 0
    assert got["violating_share"] == 0
    assert got["position_error_final_m"] < 2e-3
    steps = np.linalg.norm(np.diff(scenario.target_arrays[1], axis=0), axis=1)
    assert (steps == 0).mean() > 0.5 if joined == "hold" else steps[:-60].min() > 0


def test_a_robot_that_gives_no_answer_freezes_before_a_stream() -> None:
    """Once for all of it, since it never moves again."""
    scenario = make_scenario("csv[file=teleoperation,joined=hold]")
    run = simulate(
        scenario, Recording(lambda problem: np.zeros(7)), make_solve(None, None), Ideal(), "time"
    )
    assert evaluate(motion_of(run.trace, scenario))["freeze_events"] == 1


def test_own_obstacles_are_kept_clear_of_on_the_way(tmp_path: Path) -> None:
    """A ball across the line: `qp` goes round, `dls` runs into it as the certificate says."""
    obstacles = tmp_path / "obstacles.toml"
    obstacles.write_text("[[sphere]]\ncentre = [0.41, 0.0, 0.47]\nradius = 0.05\n")
    scenario = make_scenario(f"csv[file={TRIANGLE},obstacles={obstacles},margin=0.02]")
    line, depth = _claims(scenario)["least distance of the exact motion [m]"]
    assert (line, depth < -0.02) == (4, True)
    blind, seeing = (metrics_of(law, scenario) for law in ("dls", "qp"))
    assert blind["distance_min_m"] == pytest.approx(depth, abs=5e-3)
    assert seeing["distance_min_m"] > 0.02 - 1e-3
    assert seeing["position_error_final_m"] < 1e-3
    obstacles.write_text("[[sphere]]\ncentre = [0.31, 0.0, 0.49]\nradius = 0.05\n")
    error = scenario_error(f"csv[file={TRIANGLE},obstacles={obstacles}]")
    assert "distance from obstacles at the start [m] = -0.05002, must be >= 0.01" in error


def test_a_payload_puts_torque_limits_in_force() -> None:
    """The torques of the exact motion grow with it, and formulations are held to the limits."""
    plain = make_scenario(f"csv[file={TRIANGLE}]")
    light, heavy = (make_scenario(f"csv[file={TRIANGLE},payload={mass}]") for mass in (1, 11.2))
    assert not plain.limits_torques
    assert plain.robot.limits.effort is None
    usage = [_claims(each)["required torque over limit"][1] for each in (light, heavy)]
    assert usage[0] < 0.5 < 1.0 < usage[1]
    assert 0.9 * usage[0] < metrics_of("qp", light)["torque_usage_max"] < 1.0
    message = scenario_error(f"csv[file={TRIANGLE},payload=12]")
    assert "torque to hold the start over limit = 1.053, must be <= 1" in message


def test_a_robot_from_a_urdf_file_does_it_too() -> None:
    """The start is solved from the posture that is chosen for the file."""
    distribution = importlib.metadata.distribution("example-robot-data")
    (file,) = (f for f in distribution.files or () if f.name == "ur5_robot.urdf")
    by_file = make_scenario(f"csv[robot={file.locate()},frame=tool0,file={TRIANGLE}]")
    kinematics = Kinematics(by_file.robot)
    kinematics.update(by_file.q0)
    X = kinematics.placement(by_file.robot.frame_id)
    wanted = by_file.reference.placement(0.0).homogeneous
    assert X.homogeneous == pytest.approx(wanted, abs=1e-8)


def test_a_seed_changes_the_pace_only() -> None:
    """By at most 10 %: the poses are the user's."""
    plain = make_scenario(f"csv[file={TRIANGLE}]")
    for seed in (1, 2, 3):
        other = make_scenario(f"csv[file={TRIANGLE}]", seed)
        assert 0.9 <= other.reference.duration / plain.reference.duration <= 1.1
        assert other.reference.duration != plain.reference.duration
        assert np.array_equal(other.q0, plain.q0)
        for share in (0.2, 0.55, 0.9):
            a, b = (s.reference.placement(share * s.reference.duration) for s in (plain, other))
            assert a.homogeneous == pytest.approx(b.homogeneous)


def test_laws_follow_the_example() -> None:
    """It is well inside the arm's reach and speed."""
    scenario = make_scenario(f"csv[file={TRIANGLE}]")
    for law in ("pinv", "qp", "lp-alpha"):
        assert metrics_of(law, scenario)["position_error_max_m"] < 1e-3


@pytest.mark.parametrize(
    ("rows", "words"),
    [
        (["0,0.3,0,0.5,1,0,0,0", "1,1.5,0,0.5,1,0,0,0"], f"line 3: {OUT_OF_REACH}"),
        (["0,3,0,0.5,1,0,0,0", "1,0.3,0,0.5,1,0,0,0"], f"line 2: {OUT_OF_REACH}"),
        (
            ["0,0.3,0,0.5,1,0,0,0", "1,0.4,0,0.5,1,0,0,0", "2,0.3,0,9,1,0,0,0"],
            f"line 4: {OUT_OF_REACH}",
        ),
        (["0,0.3,0,0.5,1,0,0,0", "1,0.4,0,0.5,1,0,0,0.5"], "line 3: the quaternion's norm is"),
    ],
)
def test_a_pose_that_cannot_be_had_is_named_by_its_line(
    rows: list[str], words: str, tmp_path: Path
) -> None:
    """One line, with the path of the file."""
    path = tmp_path / "poses.csv"
    path.write_text("\n".join([HEADER, *rows]))
    with pytest.raises(DikbenchError) as caught:
        make_scenario(f"csv[file={path}]")
    assert f"pose file {path}, {words}" in str(caught.value)
    assert "\n" not in str(caught.value)


def test_a_start_outside_the_limits_is_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    """Where the robot could take the first pose only beyond one of its limits."""
    put_robot(monkeypatch, with_upper_limit("panda", 3, -2.5))
    with pytest.raises(DikbenchError, match="position margin at the start"):
        make_scenario(f"csv[file={TRIANGLE}]")


@pytest.mark.parametrize(
    ("selector", "words"),
    [
        ("csv", "parameter 'file' must be given"),
        ("csv[file=nowhere.csv]", "pose file not found: nowhere.csv"),
        (f"csv[file={TRIANGLE},robot=arm.urdf]", "robot file not found: arm.urdf"),
        (f"csv[file={TRIANGLE},q0=1 2]", "q0: expected shape (7,), got (2,)"),
        (f"csv[file={TRIANGLE},q0=a b]", "q0: expected 7 numbers, got ['a', 'b']"),
        (f"csv[file={TRIANGLE},joined=linear]", "valid: smooth, screw, hold"),
        (f"csv[file={TRIANGLE},frame=hand]", "unknown frame 'hand'"),
        (f"csv[file={TRIANGLE},dt=0.00001]", "valid: 1 to 100000"),
    ],
)
def test_errors_say_what_is_valid(selector: str, words: str) -> None:
    """One line each."""
    assert words in scenario_error(selector)
