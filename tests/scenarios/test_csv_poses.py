"""A user's own poses: followed as they are, by any robot, or refused by the line that is wrong."""

from __future__ import annotations

import importlib.metadata
from pathlib import Path

import numpy as np
import pinocchio as pin
import pytest
from makers.problems import with_upper_limit
from makers.scenarios import metrics_of, put_robot, scenario_error

from dikbench.errors import DikbenchError
from dikbench.plugins.building import make_scenario
from dikbench.robots.kinematics import Kinematics

TRIANGLE = Path(__file__).parents[1] / "data" / "triangle.csv"
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


def test_between_two_rows_the_target_moves_at_constant_speed() -> None:
    """And rests where two rows are the same."""
    reference = make_scenario(f"csv[file={TRIANGLE}]").reference
    first = reference.velocity(0.1)
    assert reference.velocity(0.9) == pytest.approx(first)
    assert pin.log6(reference.placement(0.0).actInv(reference.placement(1.0))).np == pytest.approx(
        first
    )
    assert np.abs(reference.velocity(2.2)).max() < 1e-12


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
        (f"csv[file={TRIANGLE},frame=hand]", "unknown frame 'hand'"),
        (f"csv[file={TRIANGLE},dt=0.00001]", "valid: 1 to 100000"),
    ],
)
def test_errors_say_what_is_valid(selector: str, words: str) -> None:
    """One line each."""
    assert words in scenario_error(selector)
