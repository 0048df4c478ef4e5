"""The link that most joints move."""

from __future__ import annotations

from pathlib import Path

import pytest
from makers.commands import GANTRY

from dikbench.robots.example_robot_data import data_file
from dikbench.robots.last_link import last_moved_link

TOOL_FIRST = """
<robot name="r">
  <link name="base"/><link name="arm"/><link name="tool"/><link name="camera"/>
  <joint name="mount" type="fixed"><parent link="arm"/><child link="tool"/></joint>
  <joint name="turn" type="continuous"><parent link="base"/><child link="arm"/></joint>
</robot>
"""


@pytest.mark.parametrize(
    ("file", "link"),
    [
        ("finger_edu_description/robots/finger_edu.urdf", "finger_tip_link"),
        ("xarm_description/urdf/xarm7.urdf", "link_eef"),
    ],
)
def test_it_is_the_tip_of_an_arm(file: str, link: str) -> None:
    """As its authors call it."""
    assert last_moved_link(data_file(file)) == link


def test_it_is_the_end_of_the_chain_whatever_the_order(tmp_path: Path) -> None:
    """A tool that is fixed to the last link stands before it in the file."""
    file = tmp_path / "r.urdf"
    file.write_text(TOOL_FIRST)
    assert last_moved_link(str(file)) == "tool"


def test_a_joint_that_follows_another_moves_nothing_more(tmp_path: Path) -> None:
    """The mirror of the gantry hangs on a joint that mimics its rail."""
    file = tmp_path / "gantry.urdf"
    file.write_text(GANTRY)
    assert last_moved_link(str(file)) == "hand"


def test_what_is_no_urdf_has_none(tmp_path: Path) -> None:
    """Why it is none is said where it is loaded."""
    file = tmp_path / "bad.urdf"
    file.write_text("<robot")
    assert last_moved_link(str(file)) is None
    assert last_moved_link(str(tmp_path / "missing.urdf")) is None
