"""A scene in the browser: what its nodes are told to do, and where they then are."""

from __future__ import annotations

import json
from collections import Counter
from collections.abc import Iterator
from contextlib import suppress
from typing import Any

import numpy as np
import pinocchio as pin
import pytest
from makers.browser import BROWSER, DRIVER, LONGEST_WAIT_S, browser_with

from dikbench.arrays import Array
from dikbench.plugins.building import make_scenario
from dikbench.robots.loading import load_robot
from dikbench.robots.robot import Robot, model_limits
from dikbench.viewer.moving_joints import joint_coordinates, joint_nodes, moving_joints
from dikbench.viewer.nodes import PATH_POINTS, tool_node
from dikbench.viewer.static_scene import replay_script, static_scene, surroundings
from dikbench.viewer.viser_client import client_template

pytest.importorskip("viser", reason="viser is not installed: pip install 'dikbench[replay]'")
pytest.importorskip("selenium.webdriver", reason="selenium is not installed")
pytestmark = pytest.mark.skipif(
    not (BROWSER and DRIVER), reason="no chromium with its driver is installed"
)

PAGE = """<!doctype html><meta charset="utf-8"><title>test</title>
<style>iframe {{ width: 300px; height: 200px }}</style>
<div id="host"></div>
<script>{script}</script>
<script>
const SCENE = {scene}, FRAME = openScene(document.getElementById("host"), {client}, SCENE.data);
// Pose of a node in the robot's base, (4, 4) column by column.
function poseOf(node) {{
  const viser = FRAME.contentWindow.__viserMutable;
  viser.scene.updateMatrixWorld(true);
  const base = viser.nodeRefFromName["/robot"].matrixWorld.clone().invert();
  return base.multiply(viser.nodeRefFromName[node].matrixWorld).elements;
}}
</script>"""


def zoo() -> Robot:
    """A robot with a joint of every kind, some of them with bent axes."""
    model, rng = pin.Model(), np.random.default_rng(3)
    bent = np.array([1.0, 2.0, -2.0]) / 3
    kinds = [
        pin.JointModelFreeFlyer(),
        pin.JointModelRX(),
        pin.JointModelRevoluteUnaligned(bent),
        pin.JointModelPY(),
        pin.JointModelPrismaticUnaligned(bent),
        pin.JointModelRUBZ(),
        pin.JointModelHelicalUnaligned(bent, 0.2),
        pin.JointModelSpherical(),
        pin.JointModelSphericalZYX(),
        pin.JointModelTranslation(),
        pin.JointModelPlanar(),
    ]
    joint = 0
    for number, kind in enumerate(kinds):
        turn = pin.exp3(rng.normal(size=3))
        joint = model.addJoint(joint, kind, pin.SE3(turn, 0.3 * rng.normal(size=3)), f"j{number}")
        if kind.shortname() == "JointModelRX":
            follower = pin.JointModelMimic(model.joints[joint], -2.0, 0.5)
            model.addJoint(joint, follower, pin.SE3(turn, np.ones(3)), "follower")
    model.addFrame(pin.Frame("tip", joint, 0, pin.SE3.Identity(), pin.FrameType.OP_FRAME))
    return Robot("zoo", model, "tip", model_limits(model), pin.neutral(model))


def configurations(robot: Robot) -> Array:
    """Configurations from one random one to another, (4, nq)."""
    model = robot.model
    rng = np.random.default_rng(5)
    start = pin.integrate(model, pin.neutral(model), rng.uniform(-1, 1, model.nv))
    step = rng.uniform(-1.5, 1.5, model.nv)
    return np.array([pin.integrate(model, start, k * step) for k in range(4)])


def placements(robot: Robot, q: Array) -> dict[str, Array]:
    """Placement (4, 4) of every joint's node, and of the task frame's."""
    data = robot.model.createData()
    pin.framesForwardKinematics(robot.model, data, q)
    nodes = dict(zip(joint_nodes(robot.model), (X.homogeneous for X in data.oMi), strict=True))
    return {**nodes, tool_node(robot): data.oMf[robot.frame_id].homogeneous}


@pytest.fixture(scope="module")
def robot() -> Robot:
    """The robot of the page."""
    return zoo()


@pytest.fixture(scope="module")
def page(robot: Robot, tmp_path_factory: pytest.TempPathFactory) -> Iterator[Any]:
    """A browser with a page that shows the robot, from a file."""
    from selenium.webdriver.support.ui import WebDriverWait

    folder, scene = tmp_path_factory.mktemp("page"), static_scene(robot)
    (folder / "page.html").write_text(
        PAGE.format(
            script=replay_script(),
            client=json.dumps(client_template()).replace("</", "<\\/").replace("<!--", "<\\!--"),
            scene=json.dumps({"data": scene.data, "joints": scene.joints}),
        ),
        encoding="utf-8",
    )
    with browser_with(folder / "profile") as driver:
        driver.get((folder / "page.html").as_uri())
        WebDriverWait(driver, LONGEST_WAIT_S).until(
            lambda d: d.execute_script("return isSceneReady(FRAME)")
        )
        yield driver


def poses(page: Any, expected: dict[str, Array]) -> dict[str, Array]:
    """Read the poses of nodes as soon as all are as expected, or after the longest wait."""
    from selenium.common.exceptions import TimeoutException
    from selenium.webdriver.support.ui import WebDriverWait

    def read(driver: Any) -> dict[str, Array]:
        found = driver.execute_script("return arguments[0].map(poseOf)", [*expected])
        return {
            node: np.array(pose).reshape(4, 4).T for node, pose in zip(expected, found, strict=True)
        }

    def arrived(driver: Any) -> bool:
        found = read(driver)
        return all(np.allclose(found[node], expected[node], atol=1e-5) for node in expected)

    with suppress(TimeoutException):
        WebDriverWait(page, LONGEST_WAIT_S / 4, poll_frequency=0.05).until(arrived)
    return read(page)


def test_links_are_where_pinocchio_has_them(page: Any, robot: Robot) -> None:
    """At each row of coordinates every joint, of every kind, is where its kinematics say."""
    q = configurations(robot)
    rows = joint_coordinates(robot, q)
    for k in (0, 3):
        page.execute_script("moveRobot(FRAME, SCENE.joints, arguments[0])", rows[k].tolist())
        expected = placements(robot, q[k])
        found = poses(page, expected)
        for node, placement in expected.items():
            np.testing.assert_allclose(found[node], placement, atol=1e-5, err_msg=node)


def test_coordinates_lead_from_row_to_row(robot: Robot) -> None:
    """Angles do not jump by a turn, nor quaternions to their opposite, in equal small steps."""
    model = robot.model
    step = np.full(model.nv, 0.1)
    q = np.array([pin.integrate(model, pin.neutral(model), k * step) for k in range(100)])
    assert np.abs(np.diff(joint_coordinates(robot, q), axis=0)).max() < 0.5
    kinds = Counter(joint.kind for joint in moving_joints(robot))
    assert kinds == {"turn": 4, "slide": 2, "free": 6}


def test_colours_and_surroundings(page: Any, robot: Robot) -> None:
    """A link takes the colour that is given, a line and obstacles appear, and nothing complains."""
    from selenium.webdriver.support.ui import WebDriverWait

    around = surroundings(make_scenario("obstacle[robot=planar3r]"))
    assert len(around.path) == PATH_POINTS
    row = joint_coordinates(robot, robot.q0[None])[0]
    page.execute_script(
        """const [row, messages, path] = arguments;
        send(FRAME, messages);
        drawLine(FRAME, "/path", path, [0, 114, 178]);
        moveNode(FRAME, "/target", [0.5, 0.25, 0.75, 2, 0, 0, 0]);
        moveRobot(FRAME, SCENE.joints, row, SCENE.joints.map(() => [213, 94, 0]));""",
        row.tolist(),
        around.messages,
        around.path,
    )
    there = """const tree = FRAME.contentWindow.__viserSceneTree.getState();
        return ["/obstacles/0", "/path", "/target"].every(node => tree[node]) &&
          SCENE.joints.every(j => !j.body || tree[j.body].message.props.color[0] === 213)"""
    WebDriverWait(page, LONGEST_WAIT_S).until(lambda d: d.execute_script(there))
    # The camera of the surroundings takes the place of that of the scene.
    [at] = [each["position"] for each in around.messages if "CameraPosition" in each["type"]]
    away = "return FRAME.contentWindow.__viserMutable.camera.position.length() - arguments[0]"
    distance = float(np.linalg.norm(at))
    WebDriverWait(page, LONGEST_WAIT_S).until(
        lambda d: abs(d.execute_script(away, distance)) < 1e-2 * distance
    )
    pose = np.eye(4)
    pose[:3, 3] = 0.5, 0.25, 0.75
    np.testing.assert_allclose(poses(page, {"/target": pose})["/target"], pose, atol=1e-6)
    severe = [entry for entry in page.get_log("browser") if entry["level"] == "SEVERE"]
    assert not severe
    asked = [
        event["params"]["request"]["url"]
        for entry in page.get_log("performance")
        if (event := json.loads(entry["message"])["message"])["method"]
        == "Network.requestWillBeSent"
    ]
    assert not [url for url in asked if url.startswith(("http", "ws"))]


def test_what_a_scene_weighs() -> None:
    """The scene of an arm with meshes is small, and what it carries is in its surroundings."""
    arm = static_scene(load_robot("panda"))
    assert len(arm.data) < 30_000
    assert all(joint["body"] for joint in arm.joints)
    lift = surroundings(make_scenario("torque-limited[robot=panda]"))
    assert any(message.get("name", "").endswith("/tool/payload") for message in lift.messages)
