"""The cases of an arm."""

from __future__ import annotations

from itertools import islice
from pathlib import Path

import numpy as np
import pytest

from dikbench.advice.arm import look_at
from dikbench.advice.cases import cases_for, faster_paths
from dikbench.errors import DikbenchError
from dikbench.plugins.building import make_scenario
from dikbench.robots.example_robot_data import data_file
from dikbench.scenario.reference.pose_file import read_poses

POSES = """t,x,y,z,qx,qy,qz,qw
0,0.45,0.1,0.4,1,0,0,0
2,0.45,-0.1,0.4,1,0,0,0
4,0.35,-0.1,0.5,1,0,0,0
"""


def test_families_take_turns_and_every_case_is_a_scenario(tmp_path: Path) -> None:
    """Of this arm, at this control period; another seed gives others."""
    arm = look_at("ur5")
    cases = cases_for(arm, 0.02, 0, None, None, tmp_path)
    found = list(islice(cases, 6))
    assert len({scenario.name for scenario, _ in found}) == 6
    for scenario, seed in found:
        made = make_scenario(scenario, seed)
        assert made.dt == 0.02
        assert made.robot.name == "ur5"
    other = list(islice(cases_for(arm, 0.02, 1, None, None, tmp_path), 6))
    assert not set(found) & set(other)


def test_a_family_that_does_not_fit_is_left_out_with_its_reason(tmp_path: Path) -> None:
    """In short: without the folder of the arm's file."""
    urdf = data_file("ur_description/urdf/ur5_robot.urdf")
    cases = cases_for(look_at(urdf, "tool0"), 0.02, 0, None, None, tmp_path)
    found = list(islice(cases, 4))
    assert "joint-limit-graze" in cases.left_out
    assert "joint-limit-graze" not in {scenario.name for scenario, _ in found}
    assert all(str(Path(urdf).parent) not in why for why in cases.left_out.values())


def test_a_path_is_followed_as_it_is_and_faster(tmp_path: Path) -> None:
    """The same poses at other times, and each of them is a scenario of this arm."""
    file = tmp_path / "poses.csv"
    file.write_text(POSES)
    files = faster_paths(file, tmp_path / "out")
    own = read_poses(str(file))
    for factor, faster in files.items():
        poses = read_poses(str(faster))
        np.testing.assert_allclose(poses.times, np.array(own.times) / factor)
        for one, other in zip(poses.placements, own.placements, strict=True):
            np.testing.assert_allclose(one.homogeneous, other.homogeneous, atol=1e-12)
    cases = cases_for(look_at("ur5"), 0.02, 0, file, None, tmp_path / "out")
    names = [scenario.name for scenario, _ in islice(cases, 4)]
    assert names == ["csv", "csv", "csv", "near-miss"]


def test_a_path_out_of_reach_is_one_line(tmp_path: Path) -> None:
    """Before anything runs."""
    file = tmp_path / "far.csv"
    file.write_text(POSES.replace("0.45,", "4.5,"))
    with pytest.raises(DikbenchError, match="reach") as caught:
        cases_for(look_at("ur5"), 0.02, 0, file, None, tmp_path / "out")
    assert "\n" not in str(caught.value)


def test_an_arm_that_hardly_any_family_fits_has_spare_ones(tmp_path: Path) -> None:
    """All others are left out: it reaches and sweeps, for as many cases as there is time."""
    cases = cases_for(look_at("ur5"), 0.02, 0, None, None, tmp_path)
    for family in list(cases.given):
        cases.left_out[family] = "does not fit"
    names = [scenario.name for scenario, _ in islice(cases, 4)]
    assert names == ["reach", "back-and-forth", "reach", "back-and-forth"]


def test_with_acceleration_limits_there_are_cases_that_something_can_do(tmp_path: Path) -> None:
    """Of five in turn most, and none of a family of which nothing is known."""
    cases = cases_for(look_at("ur5", acceleration="10"), 0.01, 0, None, None, tmp_path)
    made = [make_scenario(*cell) for cell in islice(cases, 6)]
    assert all(each.robot.limits.acceleration is not None for each in made)
    assert sum(each.feasible in ("time", "path") for each in made) >= 4
    assert not cases.has("near-miss")
