"""The documented table of families says which of them take a URDF."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

from dikbench.errors import DikbenchError
from dikbench.plugins.building import make_scenario
from dikbench.plugins.finding import plugins
from dikbench.robots.example_robot_data import data_file

PAGE = Path(__file__).parents[2] / "docs" / "reference" / "scenarios.md"
ROBOTS = {
    name: robots
    for name, robots in re.findall(r"^\| `([\w-]+)` \|.*\| ([^|]+) \|$", PAGE.read_text(), re.M)
    if name in plugins("scenario")
}
"""What the last column says, by family."""

REQUIRED = {"csv": f",file={Path(__file__).parents[1] / 'data' / 'triangle.csv'}"}


def test_every_family_stands_in_the_table() -> None:
    """And no other."""
    assert set(ROBOTS) == set(plugins("scenario"))


@pytest.mark.parametrize("name", ROBOTS)
def test_a_family_takes_a_urdf_where_the_table_says_so(name: str) -> None:
    """That of the UR5, whose file is a URDF like any other; else it is refused."""
    urdf = data_file("ur_description/urdf/ur5_robot.urdf")
    selector = f"{name}[robot={urdf},frame=tool0{REQUIRED.get(name, '')}]"
    if "URDF" in ROBOTS[name]:
        assert make_scenario(selector).robot.urdf == urdf
        return
    with pytest.raises(DikbenchError, match="valid: "):
        make_scenario(selector)


@pytest.mark.parametrize("name", ROBOTS)
def test_a_family_takes_the_robots_that_the_table_names(name: str) -> None:
    """And of a number of arms so many are certified."""
    known = plugins("scenario")[name].factory
    kinds = plugins("scenario")[name].parameters["robot"].choices or known.robots  # type: ignore[attr-defined]
    if number := re.search(r"(\d+) arms", ROBOTS[name]):
        assert len(kinds) == int(number[1])
    elif "any" not in ROBOTS[name]:
        assert {robot.strip() for robot in ROBOTS[name].split(",")} == set(kinds)
