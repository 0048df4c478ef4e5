"""Robots: a user's URDF, joints of every kind, and their errors."""

from __future__ import annotations

import importlib.metadata
from pathlib import Path

import numpy as np
import pinocchio as pin
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from dikbench.arrays import Array
from dikbench.errors import DikbenchError
from dikbench.problem.velocity_box import velocity_box
from dikbench.robots.catalogue import ROBOTS
from dikbench.robots.example_robot_data import data_file
from dikbench.robots.kinematics import Kinematics, smallest_singular_value
from dikbench.robots.loading import load_robot
from dikbench.robots.robot import Robot, frame_id, model_limits

URDF = """<robot name="two">
  <link name="base"/><link name="upper"/><link name="lower"/>
  <joint name="shoulder" type="revolute">
    <parent link="base"/><child link="upper"/><axis xyz="0 0 1"/>
    <limit lower="-1" upper="2" velocity="3" effort="4"/>
  </joint>
  <joint name="elbow" type="{elbow}">
    <parent link="upper"/><child link="lower"/><origin xyz="0.5 0 0"/><axis xyz="0 1 0"/>
    <limit lower="-0.5" upper="0.25" velocity="0" effort="0"/>
  </joint>
</robot>"""


def _data_file(path: str) -> str:
    for file in importlib.metadata.distribution("example-robot-data").files or ():
        if str(file).endswith(path):
            return str(file.locate())
    pytest.fail(f"example-robot-data has no {path}")


@pytest.fixture(scope="module")
def kinova() -> Robot:
    """An arm of six joints of which the first, the fourth and the last are continuous (nq 9)."""
    return load_robot(_data_file("kinova_description/robots/kinova.urdf"), "j2s6s200_end_effector")


@pytest.fixture
def urdf(tmp_path: Path) -> str:
    """The path of a small robot file."""
    path = tmp_path / "two.urdf"
    path.write_text(URDF.format(elbow="revolute"))
    return str(path)


def _sigma_min(robot: Robot, q: Array) -> float:
    kinematics = Kinematics(robot)
    kinematics.update(q)
    return smallest_singular_value(kinematics.jacobian(robot.frame_id)[list(robot.task_rows)])


# --- joints that are not one coordinate and one velocity


def test_limits_of_continuous_joints_are_indexed_by_velocity(kinova: Robot) -> None:
    """With nq = 9, nv = 6: joints 1, 4, 6 have no position limits, the others their own angle's."""
    assert (kinova.nq, kinova.nv) == (9, 6)
    continuous = np.array([True, False, False, True, False, True])
    position = kinova.limits.position
    assert position is not None
    assert np.array_equal(np.isinf(position.upper), continuous)
    assert np.array_equal(np.isinf(position.lower), continuous)
    # As the file says: 47 and 313, 19 and 341, 30 and 330 degrees.
    assert np.rad2deg(position.lower[~continuous]) == pytest.approx([47, 19, 30], abs=0.01)
    assert np.rad2deg(position.upper[~continuous]) == pytest.approx([313, 341, 330], abs=0.01)


@settings(deadline=None, max_examples=30)
@given(step=arrays(float, 6, elements=st.floats(-2.0, 2.0)))
def test_distances_move_with_the_tangent(kinova: Robot, step: Array) -> None:
    """A step changes to_upper by -step and to_lower by +step where there is a limit."""
    limited = [1, 2, 4]
    before = kinova.limits.at(kinova.q0)
    after = kinova.limits.at(pin.integrate(kinova.model, kinova.q0, step))
    for a, b, sign in (
        (before.to_upper, after.to_upper, -1),
        (before.to_lower, after.to_lower, 1),
    ):
        assert a is not None
        assert b is not None
        assert b[limited] - a[limited] == pytest.approx(sign * step[limited], abs=1e-9)
        assert np.all(np.isposinf(b[[0, 3, 5]]))


def test_a_continuous_joint_is_bounded_by_its_velocity_alone(kinova: Robot) -> None:
    """The box of the Kinova's first, fourth and last joint is the velocity limit at any angle."""
    velocity = kinova.limits.velocity
    assert velocity is not None
    for turn in np.linspace(-3, 3, 7):
        q = pin.integrate(kinova.model, kinova.q0, np.array([turn, 0, 0, turn, 0, turn]))
        box = velocity_box(kinova.limits.at(q), None, 1.0)
        free = [0, 3, 5]
        assert np.array_equal(box.upper[free], velocity.upper[free])
        assert np.array_equal(box.lower[free], velocity.lower[free])


def test_a_continuous_joint_cannot_get_a_position_limit(kinova: Robot) -> None:
    """Its configuration is (cos, sin): a bound on an angle would be read off the wrong number."""
    with pytest.raises(DikbenchError, match=r"expected inf at \[0, 3, 5\]"):
        kinova.with_limits(position=(-1.0, 1.0))


def test_the_start_of_a_urdf_is_usable(kinova: Robot) -> None:
    """Without a table: inside the limits, on the manifold, away from singularities."""
    seen = kinova.limits.at(kinova.q0)
    assert seen.to_lower is not None
    assert seen.to_upper is not None
    assert min(seen.to_lower.min(), seen.to_upper.min()) > 0.02
    assert np.allclose(pin.normalize(kinova.model, kinova.q0), kinova.q0)
    assert _sigma_min(kinova, kinova.q0) > 0.03


@pytest.mark.parametrize(
    ("root", "nv"), [(pin.JointModelFreeFlyer(), 6), (pin.JointModelPlanar(), 3)]
)
@pytest.mark.parametrize("bound", [1.0, np.finfo(float).max])
def test_artificial_bounds_of_a_floating_base_are_dropped(
    root: pin.JointModel, nv: int, bound: float
) -> None:
    """A free-flyer's or planar joint's bounds are none; the joint behind it keeps its own."""
    model = pin.Model()
    base = model.addJoint(0, root, pin.SE3.Identity(), "root")
    model.addJoint(base, pin.JointModelRX(), pin.SE3.Identity(), "arm")
    model.lowerPositionLimit = np.full(model.nq, -bound)
    model.upperPositionLimit = np.full(model.nq, bound)
    model.lowerPositionLimit[-1], model.upperPositionLimit[-1] = -0.5, 0.25
    limits = model_limits(model)
    assert limits.position is not None
    assert np.array_equal(limits.position.lower, [-np.inf] * nv + [-0.5])
    assert np.array_equal(limits.position.upper, [np.inf] * nv + [0.25])
    q = pin.neutral(model)
    q[-1] = 0.125
    seen = limits.at(q)
    assert seen.to_upper == pytest.approx([np.inf] * nv + [0.125])
    assert seen.to_lower == pytest.approx([np.inf] * nv + [0.625])


def test_a_floating_base_alone_has_no_limits() -> None:
    """Nor is there a last joint whose bounds could be taken for its own."""
    model = pin.Model()
    model.addJoint(0, pin.JointModelFreeFlyer(), pin.SE3.Identity(), "root")
    model.lowerPositionLimit, model.upperPositionLimit = np.full(7, -1.01), np.full(7, 1.01)
    position = model_limits(model).position
    assert position is not None
    assert np.array_equal(position.upper, [np.inf] * 6)
    assert np.array_equal(position.lower, [-np.inf] * 6)


def test_zero_and_the_largest_double_in_a_model_mean_that_it_does_not_say() -> None:
    """Velocity or effort 0, and anything above 1e20, become infinite."""
    model = pin.Model()
    parent = 0
    for k in range(3):
        parent = model.addJoint(parent, pin.JointModelRX(), pin.SE3.Identity(), f"j{k}")
    huge = np.finfo(float).max
    model.lowerPositionLimit = np.array([-huge, -1.0, -2.0])
    model.upperPositionLimit = np.array([1.0, huge, 2.0])
    model.velocityLimit = np.array([0.0, huge, 3.0])
    model.effortLimit = np.array([huge, 0.0, 4.0])
    limits = model_limits(model)
    assert limits.position is not None
    assert limits.velocity is not None
    assert limits.effort is not None
    assert np.array_equal(limits.position.lower, [-np.inf, -1, -2])
    assert np.array_equal(limits.position.upper, [1, np.inf, 2])
    assert np.array_equal(limits.velocity.upper, [np.inf, np.inf, 3])
    assert np.array_equal(limits.velocity.lower, [-np.inf, -np.inf, -3])
    assert np.array_equal(limits.effort.upper, [np.inf, np.inf, 4])


# --- files and names that come from a user


def test_a_urdf_gives_its_own_limits(urdf: str) -> None:
    """Position and velocity as written; a velocity of zero means none."""
    robot = load_robot(urdf, "lower")
    assert (robot.name, robot.nv) == ("two", 2)
    assert robot.limits.position is not None
    assert robot.limits.velocity is not None
    assert np.array_equal(robot.limits.position.lower, [-1, -0.5])
    assert np.array_equal(robot.limits.position.upper, [2, 0.25])
    assert np.array_equal(robot.limits.velocity.upper, [3, np.inf])
    assert robot.available_acceleration is None


def test_a_frame_can_be_chosen() -> None:
    """The catalogue's frame is a default; the robot that is in store stays as it is."""
    assert load_robot("panda", "panda_link5").frame == "panda_link5"
    assert load_robot("panda").frame == "panda_hand_tcp"
    other = load_robot("panda", "panda_link5")
    assert other.model.frames[other.frame_id].name == "panda_link5"


def test_a_start_can_be_chosen(urdf: str) -> None:
    """Any posture inside the limits, of the right size."""
    assert np.array_equal(load_robot(urdf, "lower", start=[1.5, -0.25]).q0, [1.5, -0.25])
    with pytest.raises(DikbenchError, match="outside the position limits"):
        load_robot(urdf, "lower", start=[1.5, 0.3])
    with pytest.raises(DikbenchError, match=r"expected shape \(2,\), got \(3,\)"):
        load_robot(urdf, "lower", start=[0, 0, 0])
    with pytest.raises(DikbenchError, match="expected finite numbers"):
        load_robot(urdf, "lower", start=[0, float("nan")])


def _error(name: str, frame: str | None = None) -> str:
    with pytest.raises(DikbenchError) as caught:
        load_robot(name, frame)
    message = str(caught.value)
    assert "\n" not in message
    return message


def test_unknown_robots_name_the_nearest_and_the_valid_ones() -> None:
    """A typing error is answered by what was meant."""
    message = _error("pnada")
    assert "did you mean 'panda'?" in message
    assert all(name in message for name in ROBOTS)


@pytest.mark.parametrize("path", ["nowhere.urdf", "no/such/file", "x" * 300 + ".urdf"])
def test_a_missing_file_is_said_to_be_missing(path: str) -> None:
    """Whether there is none, it is a folder, or its name cannot be one."""
    assert _error(path, "tool") == f"robot file not found: {path}"


@pytest.mark.parametrize(
    "text", ["", "not xml", "<robot", "<html/>", '<robot name="x"/>', "\x00\xff\x80"]
)
def test_a_file_that_does_not_parse_is_named(tmp_path: Path, text: str) -> None:
    """One line with the file's name, whatever is in it."""
    path = tmp_path / "broken.urdf"
    path.write_bytes(text.encode("latin-1"))
    assert _error(str(path), "tool").startswith(f"robot file {path} is not a URDF")


def test_a_robot_that_cannot_move_is_refused(tmp_path: Path) -> None:
    """A model without joints has nothing to control."""
    path = tmp_path / "rock.urdf"
    path.write_text('<robot name="rock"><link name="rock"/></robot>')
    assert "no moving joint" in _error(str(path), "rock")


def test_a_urdf_without_a_frame_lists_its_frames(urdf: str) -> None:
    """A URDF has no default frame; the error says which there are."""
    message = _error(urdf)
    assert "name its task frame" in message
    for frame in ("base", "upper", "lower"):
        assert frame in message


def test_a_urdf_of_many_frames_says_where_they_are_listed() -> None:
    """The last ones, which are nearest to a tool, how many there are, and the command."""
    path = data_file("talos_data/robots/talos_reduced.urdf")
    with pytest.raises(DikbenchError) as caught:
        load_robot(path)
    said = str(caught.value)
    frames = [frame.name for frame in pin.buildModelFromUrdf(path).frames][1:]
    assert f"... ({len(frames)} in all, listed by `dikbench show {path}`)" in said
    assert frames[-1] in said
    assert len(said) - 2 * len(path) < 250


def test_unknown_frames_name_the_nearest_and_the_valid_ones(urdf: str) -> None:
    """For a URDF and for a robot of the catalogue alike."""
    message = _error(urdf, "loewr")
    assert "did you mean 'lower'?" in message
    assert "upper" in message
    assert "did you mean 'panda_hand_tcp'?" in _error("panda", "panda_hand_tpc")
    with pytest.raises(DikbenchError, match="unknown frame"):
        frame_id(load_robot("ur5").model, "panda_hand_tcp")


@pytest.mark.parametrize("wrong", [[0.0] * 6, [0.0] * 8, "posture", None, [np.inf] * 7])
def test_a_wrong_configuration_is_an_error(wrong: object) -> None:
    """Shape, type and finiteness are checked where a configuration comes from outside."""
    with pytest.raises(DikbenchError, match=r"^q: expected"):
        load_robot("panda").configuration(wrong)


def test_a_configuration_is_copied() -> None:
    """What the caller does to the array later does not reach the robot."""
    mine = np.zeros(7)
    checked = load_robot("panda").configuration(mine)
    mine[0] = 1.0
    assert checked[0] == 0.0
