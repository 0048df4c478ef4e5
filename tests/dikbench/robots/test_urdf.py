"""What people's URDFs contain: mimic joints, odd ranges, grippers, and what makes no sense."""

from __future__ import annotations

import itertools
from pathlib import Path

import numpy as np
import pinocchio as pin
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from makers.urdfs import DATA, SIX, Joint, write_arm

import dikbench
from dikbench.errors import DikbenchError
from dikbench.plugins.building import make_scenario
from dikbench.problem import Array, Kinematics, Robot
from dikbench.robots.collision.obstacles import SphereObstacle
from dikbench.robots.collision.pairs import CollisionPairs
from dikbench.robots.loading import load_robot
from dikbench.robots.urdf import Root
from dikbench.scenario import Variation

STEP = 1e-6


def finite_difference(robot: Robot, q: Array) -> Array:
    """Compute the body Jacobian of the task frame (6, nv) at q by central differences."""
    columns, kinematics = [], Kinematics(robot)
    for unit in np.eye(robot.nv):
        placements = []
        for side in (1, -1):
            kinematics.update(pin.integrate(robot.model, q, side * STEP * unit))
            placements.append(kinematics.placement(robot.frame_id).copy())
        columns.append(pin.log6(placements[1].actInv(placements[0])).np / (2 * STEP))
    return np.array(columns).T


def test_a_mimic_joint_follows(tmp_path: Path) -> None:
    """The planar arm of three joints with j3 = -j2: closed form by hand.

    With x = 0.3 (c1 + c12 + c1) + ... the pseudo-inverse of its Jacobian gives this velocity.
    """
    joints = (Joint(offset="0 0 0"), Joint(), Joint(mimic='joint="j2" multiplier="-1"'))
    robot = load_robot(write_arm(tmp_path, joints), frame="tool")
    assert (robot.nq, robot.nv) == (2, 2)
    a, b = 0.2, 0.5
    answer = dikbench.solve_dik(robot, [a, b], twist=[0.02, 0.05, 0, 0, 0, 0], formulation="pinv")
    # In the frame of the tool, which is turned by a alone: links at the angles 0, b and 0.
    J = np.zeros((6, 2))
    J[:2, 0] = [-0.3 * np.sin(b), 0.6 + 0.3 * np.cos(b)]
    J[:2, 1] = [-0.3 * np.sin(b), 0.3 * np.cos(b)]
    J[5, 0] = 1.0
    np.testing.assert_allclose(
        answer.velocity, np.linalg.pinv(J) @ [0.02, 0.05, 0, 0, 0, 0], atol=1e-12
    )
    np.testing.assert_allclose(answer.velocity, [0.011, 0.084], atol=5e-4)


MIMICS: dict[str, dict[int, tuple[int, float, float]]] = {
    "offset": {4: (2, -2.0, 0.1)},
    "chained": {3: (2, 0.5, 0.2), 5: (3, -1.0, 0.0)},
    "of a joint after it": {2: (5, 0.5, -0.3)},
    "two of a joint after them": {1: (6, 2.0, 0.1), 3: (6, -0.5, 0.0)},
    "slides": {6: (1, 0.05, 0.0)},
    "turns on": {4: (3, 1.0, 0.0)},
}
"""Joints that follow others: which, multiplier, offset."""

KINDS = {"slides": {6: "prismatic"}, "turns on": {3: "continuous", 4: "continuous"}}


@pytest.mark.parametrize("case", MIMICS)
def test_mimic_joints_keep_their_law_and_their_jacobian(case: str, tmp_path: Path) -> None:
    """Poses are those of a model whose joints are all free, at positions that obey the laws."""
    laws, kinds = MIMICS[case], KINDS.get(case, {})
    joints = [
        Joint(joint.axis, kinds.get(n, "revolute"), mimic=_mimic(*laws[n]) if n in laws else "")
        for n, joint in enumerate(SIX, start=1)
    ]
    robot = load_robot(write_arm(tmp_path, joints), frame="tool")
    assert robot.nv == 6 - len(laws)
    free = pin.buildModelFromUrdf(write_arm(tmp_path, joints, "free"))
    data, kinematics, random = free.createData(), Kinematics(robot), np.random.default_rng(3)
    for _ in range(5):
        q = robot.inside(pin.integrate(robot.model, robot.q0, random.uniform(-0.3, 0.3, robot.nv)))
        kinematics.update(q)
        np.testing.assert_allclose(
            kinematics.jacobian(robot.frame_id), finite_difference(robot, q), atol=1e-8
        )
        known = {
            int(name[1:]): q[j.idx_q] if j.nq == 1 else np.arctan2(q[j.idx_q + 1], q[j.idx_q])
            for name, j in list(zip(robot.model.names, robot.model.joints, strict=True))[1:]
            if j.nv == 1
        }
        for _ in laws:  # as many rounds as it may take
            for joint, (other, multiplier, offset) in laws.items():
                if other in known:
                    known.setdefault(joint, multiplier * known[other] + offset)
                elif joint in known:
                    known[other] = (known[joint] - offset) / multiplier
        full = pin.neutral(free)
        for name, j in list(zip(free.names, free.joints, strict=True))[1:]:
            angle = known[int(name[1:])]
            full[j.idx_q : j.idx_q + j.nq] = (np.cos(angle), np.sin(angle)) if j.nq == 2 else angle
        pin.framesForwardKinematics(free, data, full)
        np.testing.assert_allclose(
            kinematics.placement(robot.frame_id).homogeneous,
            data.oMf[free.getFrameId("tool")].homogeneous,
            atol=1e-12,
        )


def _mimic(other: int, multiplier: float, offset: float) -> str:
    return f'joint="j{other}" multiplier="{multiplier}" offset="{offset}"'


def test_the_limits_of_followers_hold(tmp_path: Path) -> None:
    """They narrow the range and the speed of the joint that they follow."""
    narrow = Joint(
        limit='lower="-0.5" upper="0.7" effort="9" velocity="1.5"',
        mimic='joint="j2" multiplier="-3" offset="0.1"',
    )
    robot = load_robot(write_arm(tmp_path, (Joint(), Joint(), narrow)), frame="tool")
    position, velocity = robot.limits.position, robot.limits.velocity
    assert position is not None
    assert velocity is not None
    np.testing.assert_allclose([position.lower[1], position.upper[1]], [-0.2, 0.2])
    np.testing.assert_allclose(velocity.upper, [2.0, 0.5])


def test_gradients_of_distances_know_followers(tmp_path: Path) -> None:
    """A body after a joint and before its follower moves with the one, one after both with both."""
    joints = [Joint(j.axis, mimic='joint="j2"' if n == 4 else "") for n, j in enumerate(SIX, 1)]
    path = write_arm(tmp_path, joints)
    robot = load_robot(path, frame="tool")
    # Without its file the bodies are capsules along the links.
    bare = Robot(robot.name, robot.model, robot.frame, robot.limits, robot.q0)
    pairs = CollisionPairs(bare, [SphereObstacle((0.5, 0.4, 0.9), 0.1)], 0.01, self_collision=True)
    kinematics, q = Kinematics(bare), robot.q0
    kinematics.update(q)
    pairs.distances(kinematics)
    gradients = pairs.gradients(kinematics, np.arange(len(pairs)))
    for k, unit in enumerate(np.eye(robot.nv)):
        ends = []
        for side in (1, -1):
            kinematics.update(q + side * STEP * unit)
            ends.append(pairs.distances(kinematics))
        expected = (ends[0] - ends[1]) / (2 * STEP)
        np.testing.assert_allclose(gradients[:, k], expected, atol=1e-5)


ranges = st.tuples(
    st.sampled_from(["revolute", "prismatic"]),
    st.floats(-50, 50, allow_subnormal=False),
    st.floats(1e-3, 100, allow_subnormal=False),
)


@settings(suppress_health_check=[HealthCheck.function_scoped_fixture], max_examples=40)
@given(kinds=st.lists(ranges, min_size=1, max_size=7), fingers=st.lists(ranges, max_size=2))
def test_starts_are_inside_the_limits_whatever_they_are(
    tmp_path: Path, kinds: list[tuple[str, float, float]], fingers: list[tuple[str, float, float]]
) -> None:
    """Also of the joints that do not move the frame, which no seed moves either."""
    axes = itertools.cycle(joint.axis for joint in SIX)

    def made(parts: list[tuple[str, float, float]]) -> list[Joint]:
        return [
            Joint(
                next(axes), kind, f'lower="{low!r}" upper="{low + size!r}" effort="9" velocity="1"'
            )
            for kind, low, size in parts
        ]

    robot = load_robot(write_arm(tmp_path, made(kinds), gripper=made(fingers)), frame="tool")
    at = robot.limits.at(robot.q0)
    assert at.to_lower is not None
    assert at.to_upper is not None
    assert min(at.to_lower.min(), at.to_upper.min()) >= 0
    off_chain = np.setdiff1d(np.arange(robot.nv), robot.chain)
    assert len(off_chain) == len(fingers)
    moved = Variation(start=0.5).drawn(7).posture(robot, robot.q0)
    np.testing.assert_array_equal(moved[off_chain], robot.q0[off_chain])
    np.testing.assert_array_equal(robot.inside(moved), moved)


def test_the_start_is_well_conditioned_by_the_joints_that_move_the_frame(tmp_path: Path) -> None:
    """A gripper does not make an arm of five joints one of six."""
    robot = load_robot(str(DATA / "five_dof_gripper.urdf"), frame="tool")
    kinematics = Kinematics(robot)
    kinematics.update(robot.q0)
    singular = np.linalg.svd(kinematics.jacobian(robot.frame_id), compute_uv=False)
    assert singular[4] > 0.15


REFUSED = {
    "axis_zero": ("tool", "joint 'joint3' has the axis '0 0 0'"),
    "lower_gt_upper": ("tool", "joint 'joint3' has a lower limit above its upper one: 2 > -2"),
    "massless_neg": ("tool", "link 'link3' has a negative mass"),
    "only_fixed": ("tool", "the model has no moving joint"),
    "limits_missing_bounds": (
        "tool",
        "joint 'joint3' cannot move: its position limits are both 0",
    ),
    "base": ("link0", "no joint moves frame link0"),
}


@pytest.mark.parametrize("name", REFUSED)
def test_what_makes_no_sense_is_refused_by_name(name: str) -> None:
    """In one line that names the joint, the link or the frame."""
    frame, message = REFUSED[name]
    with pytest.raises(DikbenchError) as caught:
        load_robot(str(DATA / f"{name}.urdf"), frame=frame)
    assert message in str(caught.value)
    assert "\n" not in str(caught.value)


BAD_JOINTS = {
    "mimics itself": Joint(mimic='joint="j2"'),
    "mimics 'to_tool', which does not move": Joint(mimic='joint="to_tool"'),
    "mimics 'nobody', which does not move": Joint(mimic='joint="nobody"'),
    "multiplier='twice' is not a number": Joint(mimic='joint="j1" multiplier="twice"'),
    "has a limit without velocity": Joint(limit='lower="-1" upper="1" effort="1"'),
    "has a negative velocity limit": Joint(limit='lower="-1" upper="1" velocity="-1" effort="1"'),
    "no position is inside the limits of both": Joint(mimic='joint="j1" offset="10"'),
    "has the axis '0 0 nan'": Joint("0 0 nan"),
}


@pytest.mark.parametrize("message", BAD_JOINTS)
def test_a_joint_that_makes_no_sense_is_refused_by_name(message: str, tmp_path: Path) -> None:
    """In one line."""
    path = write_arm(tmp_path, (Joint(), BAD_JOINTS[message], Joint()))
    with pytest.raises(DikbenchError) as caught:
        load_robot(path, frame="tool")
    said = str(caught.value)
    assert "'j2'" in said
    assert message in said
    assert "\n" not in said


def test_joints_that_mimic_in_a_circle_are_refused(tmp_path: Path) -> None:
    """Not followed for ever."""
    joints = (Joint(), Joint(mimic='joint="j3"'), Joint(mimic='joint="j2"'))
    with pytest.raises(DikbenchError, match="mimics itself"):
        load_robot(write_arm(tmp_path, joints), frame="tool")


def test_of_a_joint_and_a_link_of_one_name_the_link_is_meant() -> None:
    """The frame of the joint may be elsewhere."""
    robot = load_robot(str(DATA / "same_name_joint_link.urdf"), frame="link6")
    assert robot.model.frames[robot.frame_id].type == pin.FrameType.BODY


@pytest.mark.parametrize("root", ["planar", "free"])
def test_a_root_that_moves(root: Root, tmp_path: Path) -> None:
    """It carries the frame; the arm's own columns are those of the fixed one."""
    path = write_arm(tmp_path, SIX)
    fixed, robot = load_robot(path, "tool"), load_robot(path, "tool", root=root)
    extra = {"planar": 3, "free": 6}[root]
    assert robot.nv == 6 + extra
    assert list(robot.chain) == list(range(6 + extra))
    q = np.concatenate([pin.neutral(robot.model)[: robot.nq - 6], fixed.q0])
    J = []
    for each, at in ((fixed, fixed.q0), (robot, q)):
        kinematics = Kinematics(each)
        kinematics.update(at)
        J.append(kinematics.jacobian(each.frame_id).copy())
    np.testing.assert_allclose(J[1][:, extra:], J[0], atol=1e-12)
    np.testing.assert_allclose(J[1], finite_difference(robot, q), atol=1e-8)


def test_a_wrong_root_lists_the_valid_ones(tmp_path: Path) -> None:
    """And a robot of the catalogue has its own."""
    with pytest.raises(DikbenchError, match=r"unknown root 'flying'.*fixed, free, planar"):
        load_robot(write_arm(tmp_path, SIX), "tool", root="flying")  # type: ignore[arg-type]
    with pytest.raises(DikbenchError, match="root=free is for a URDF"):
        load_robot("panda", root="free")


def test_rows_that_depend_on_each_other_are_refused() -> None:
    """Three turns and two lines are too much for the wrist of these five joints."""
    at = f"robot={DATA / 'five_dof.urdf'},frame=tool"
    with pytest.raises(DikbenchError, match="its 5 joints move 4 independently"):
        make_scenario(f"reach[{at},rows=xyrxryrz]")


def test_limits_by_hand(tmp_path: Path) -> None:
    """For all joints or one each; acceleration limits are in force at once."""
    path = write_arm(tmp_path, SIX)
    robot = load_robot(path, "tool", velocity="1 2 3 4 5 6", acceleration=10)
    velocity, acceleration = robot.limits.velocity, robot.limits.acceleration
    assert velocity is not None
    assert acceleration is not None
    np.testing.assert_array_equal(velocity.upper, [1, 2, 3, 4, 5, 6])
    np.testing.assert_array_equal(acceleration.lower, [-10] * 6)
    with pytest.raises(DikbenchError, match="velocity='fast' is not valid"):
        load_robot(path, "tool", velocity="fast")
    with pytest.raises(DikbenchError, match="expected a number or 6 numbers"):
        load_robot(path, "tool", velocity="1 2")


@settings(suppress_health_check=[HealthCheck.function_scoped_fixture], max_examples=200)
@given(text=st.text(alphabet='<>/="joint linkaxs 0.1-9e+revoluticm\n', max_size=400))
def test_any_text_as_a_urdf_gives_one_line(tmp_path: Path, text: str) -> None:
    """Never a traceback."""
    path = tmp_path / "any.urdf"
    path.write_text(f'<robot name="r"><link name="a"/><link name="b"/>{text}</robot>')
    with pytest.raises(DikbenchError) as caught:
        load_robot(str(path), frame="b")
    assert "\n" not in str(caught.value)


def test_a_xacro_file_is_to_be_expanded_first(tmp_path: Path) -> None:
    """Whatever its name; what xacro wrote, which keeps the name space, is a URDF."""
    text = Path(write_arm(tmp_path, SIX)).read_text()
    space = '<robot xmlns:xacro="http://www.ros.org/wiki/xacro" '
    expanded = text.replace("<robot ", space, 1)
    assert expanded != text
    unexpanded = expanded.replace("</robot>", '<xacro:gripper side="left"/></robot>')
    for name in ("arm.xacro", "arm.urdf.xacro", "left.urdf"):
        path = tmp_path / name
        path.write_text(unexpanded)
        with pytest.raises(DikbenchError, match=r"is a xacro file; run `xacro .* > robot\.urdf`"):
            load_robot(str(path), "tool")
        path.write_text(expanded)
        assert load_robot(str(path), "tool").nv == 6
    with pytest.raises(DikbenchError, match=r"robot file not found: other\.xacro"):
        load_robot("other.xacro", "tool")


def test_an_effort_limit_is_the_joints_own_whatever_follows_it(tmp_path: Path) -> None:
    """A follower with a motor would widen it and one on a linkage would not: nobody tells."""
    limit = 'lower="-1" upper="1" effort="0.5" velocity="1"'
    joints = [*SIX, Joint("0 0 1", limit=limit, mimic='joint="j6" multiplier="-2"')]
    robot = load_robot(write_arm(tmp_path, joints), "tool")
    assert robot.available_effort is not None
    assert robot.available_effort.tolist() == [10.0] * 6
