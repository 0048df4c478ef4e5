"""An arm looked at."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pinocchio as pin
import pytest
from makers.commands import GANTRY, in_process

from dikbench.advice.arm import look_at
from dikbench.advice.control_loop import control_loop
from dikbench.errors import DikbenchError
from dikbench.plugins.building import make_family
from dikbench.robots.example_robot_data import data_file
from dikbench.robots.loading import load_robot
from dikbench.selector import Selector

CLICK = ("Usage: ", "Try '", " ")
"""What click adds here; `dikbench` itself leaves it out."""

ARM = """
<robot name="arm">
  <link name="l0"/><link name="l1"/><link name="l2"/><link name="l3"/><link name="l4"/>
  <joint name="turn" type="continuous"><parent link="l0"/><child link="l1"/>
    <axis xyz="0 0 1"/></joint>
  <joint name="lift" type="revolute"><parent link="l1"/><child link="l2"/><origin xyz="0 0 0.3"/>
    <axis xyz="0 1 0"/><limit lower="-2" upper="2" velocity="2" effort="5"/></joint>
  <joint name="bend" type="revolute"><parent link="l2"/><child link="l3"/><origin xyz="0.4 0 0"/>
    <axis xyz="0 1 0"/><limit lower="0.2" upper="2.5" velocity="0" effort="5"/></joint>
  <joint name="tip" type="fixed"><parent link="l3"/><child link="l4"/>
    <origin xyz="0.3 0 0"/></joint>
</robot>
"""


def test_singularities_of_a_ur_are_classified() -> None:
    """A UR5 has wrists, which are crossed, and elbows, which fold; each is one exactly."""
    arm = look_at("ur5")
    assert {each.kind for each in arm.singular} >= {"crossing", "fold"}
    assert arm.assumed == ()
    for each in arm.singular:
        assert np.linalg.svd(each.jacobian)[1][-1] < 1e-7


def test_what_a_urdf_lacks_is_assumed_and_said(tmp_path: Path) -> None:
    """Frame, rows and speed limits; what it has stays; a family takes all of it."""
    file = tmp_path / "arm.urdf"
    file.write_text(ARM)
    arm = look_at(str(file))
    assert arm.robot.frame == "l3" or arm.robot.frame == "l4"
    assert arm.parameters["rows"] == "xyz"
    velocity = arm.robot.limits.velocity
    assert velocity is not None
    assert velocity.upper.tolist() == [1.0, 2.0, 1.0]
    text = " ".join(arm.assumed)
    assert "turn, bend" in text
    assert "3 joints move it" in text
    assert "turn without end, or have no position limit: turn" in " ".join(arm.facts)
    make_family(Selector("reach", {**arm.parameters, "dt": "0.01"}))


def test_sliding_and_mimicking_joints_are_taken(tmp_path: Path) -> None:
    """A gantry of two joints is too little for advice, and that is one line."""
    file = tmp_path / "gantry.urdf"
    file.write_text(GANTRY)
    with pytest.raises(
        DikbenchError, match=r"2 joints move frame hand.*valid: a frame that at least 3"
    ):
        look_at(str(file))
    with pytest.raises(DikbenchError, match="1 joints move frame"):
        look_at(str(file), "mirror")


def test_errors_of_the_command_are_one_line(tmp_path: Path) -> None:
    """Whatever is unknown, obstacles without a path, a path that is none or out of reach."""
    far = tmp_path / "far.csv"
    far.write_text("t,x,y,z,qx,qy,qz,qw\n0,9,9,9,0,0,0,1\n1,9,9,9.1,0,0,0,1\n")
    for arguments, words in (
        (("no-robot",), "no-robot"),
        (("ur5", "--frame", "elbow"), "elbow"),
        (("ur5", "--need", "speed"), "speed"),
        (("ur5", "--formulation", "magic"), "magic"),
        (("ur5", "--budget", "soon"), "3min"),
        (("ur5", "--obstacles", "cell.toml"), "--path"),
        (("ur5", "--path", "none.csv"), "none.csv"),
        (("ur5", "--path", str(far), "--out", str(tmp_path / "out")), "reach"),
        (("ur5", "--acceleration", "fast"), "fast"),
    ):
        answer = in_process("advise", *arguments)
        assert answer.exit_code == 2, answer.output
        assert words in answer.output
        own = [line for line in answer.output.splitlines() if not line.startswith(CLICK)]
        assert len([line for line in own if line]) == 1, answer.output


@pytest.mark.parametrize("law", [("qp", "daqp[then=clarabel]"), ("pinv[after=scale]", "none")])
@pytest.mark.parametrize("robot", ["ur5", "urdf"])
def test_the_printed_program_reaches_its_target(robot: str, law: tuple[str, str]) -> None:
    """As it is printed, within its three seconds, every speed limit kept."""
    urdf = data_file("ur_description/urdf/ur5_robot.urdf")
    arm = look_at(robot) if robot == "ur5" else look_at(urdf, "tool0", "10")
    names: dict[str, object] = {}
    program = control_loop(arm.parameters, 0.02, *law)
    assert sum(bool(line) for line in program.splitlines()) <= 15
    exec(program, names)
    made = names["robot"]
    found = load_robot(urdf, "tool0").model
    data = found.createData()
    pin.framesForwardKinematics(found, data, np.array(names["q"]))
    tip = data.oMf[found.getFrameId("tool0")]
    target = names["target"]
    assert isinstance(target, pin.SE3)
    assert np.linalg.norm(tip.translation - target.translation) < 1e-3
    assert made is not None
