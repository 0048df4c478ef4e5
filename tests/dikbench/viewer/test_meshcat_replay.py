"""The replay as a file: everything is in it, and what moves is where the robot was."""

from __future__ import annotations

import base64
import os
import re
import signal
import subprocess
import sys
import urllib.request
from pathlib import Path
from typing import Any

import numpy as np
import pinocchio as pin
import pytest
from click.testing import CliRunner, Result
from makers.commands import hear_ctrl_c

from dikbench.arrays import Array
from dikbench.cli import commands
from dikbench.robots.robot import Robot
from dikbench.viewer.limit_use import nearness
from dikbench.viewer.recording import Recording, find_recording

WITHOUT = "meshcat is not installed: pip install 'dikbench[replay]'"
EVERY = ("speed-sweep", "reach")


def dikbench(*arguments: object) -> Result:
    """`dikbench replay` with the arguments."""
    return CliRunner().invoke(commands, ["replay", *map(str, arguments)])


def recording_of(runs: Path, family: str) -> Recording:
    """The trial of a scenario family."""
    results = runs / "runs" / "viewed"
    (trial,) = (
        line.partition(",")[0]
        for line in (results / "trials.csv").read_text().splitlines()
        if f",{family}[" in line or f',"{family}[' in line
    )
    return find_recording(trial, results)


@pytest.fixture(scope="module")
def pages(runs: Path, tmp_path_factory: pytest.TempPathFactory) -> dict[str, str]:
    """The replays of the trials, twice as fast as the robot."""
    pytest.importorskip("meshcat", reason=WITHOUT)
    folder, found = tmp_path_factory.mktemp("html"), {}
    for family in EVERY:
        file = folder / f"{family}.html"
        result = dikbench(
            recording_of(runs, family).id, "--results", runs / "runs" / "viewed", "--html", file,
            "--speed", 2,
        )  # fmt: skip
        assert result.exit_code == 0, result.output
        assert result.output.splitlines()[-1] == str(file)
        assert "red: past a limit" in result.output
        found[family] = file.read_text(encoding="utf-8")
    return found


def sent(page: str) -> list[Any]:
    """The commands to the viewer that a page holds."""
    umsgpack = pytest.importorskip("umsgpack", reason=WITHOUT)
    return [
        umsgpack.unpackb(base64.b64decode(text))
        for text in re.findall(r'fetch\("data:application/octet-binary;base64,([^"]+)"\)', page)
    ]


def tracks(page: str) -> tuple[dict[str, dict[str, Any]], float]:
    """The keyframes of the animation by node and property, and their number per second."""
    (animation,) = (command for command in sent(page) if command["type"] == "set_animation")
    assert animation["options"]["repetitions"] == float("inf")
    rates = {clip["clip"]["fps"] for clip in animation["animations"]}
    assert len(rates) == 1
    found = {
        clip["path"].removeprefix("/meshcat/"): {
            track["name"]: track["keys"] for track in clip["clip"]["tracks"]
        }
        for clip in animation["animations"]
    }
    return found, rates.pop()


def pose(node: dict[str, Any], key: int) -> Array:
    """The placement of a node at one of its keyframes, (4, 4)."""
    x, y, z, w = node[".quaternion"][key]["value"]
    rotation = pin.Quaternion(w, x, y, z).matrix()
    placement: Array = pin.SE3(rotation, np.array(node[".position"][key]["value"])).homogeneous
    return placement


def tip(robot: Robot, q: Array) -> Array:
    """Placement of the task frame, (4, 4)."""
    data = robot.model.createData()
    pin.framesForwardKinematics(robot.model, data, q)
    placement: Array = data.oMf[robot.frame_id].homogeneous
    return placement


@pytest.mark.parametrize("family", EVERY)
def test_a_page_needs_nothing_else(pages: dict[str, str], runs: Path, family: str) -> None:
    """No script, style or picture is fetched from anywhere, and the trial is named."""
    page = pages[family]
    assert not re.search(r"""<(script|link|img)[^>]+(src|href)\s*=""", page)
    recording = recording_of(runs, family)
    assert str(recording.trial.scenario) in page
    assert f"<title>{recording.id}</title>" in page
    assert "past a limit" in page


@pytest.mark.parametrize("family", EVERY)
def test_tool_and_target_move_as_they_did(pages: dict[str, str], runs: Path, family: str) -> None:
    """First and last keyframe are the task frame and the reference then, at the right time."""
    recording = recording_of(runs, family)
    scenario, trace = recording.scenario, recording.trace
    moving, rate = tracks(pages[family])
    for key, k in ((0, 0), (-1, trace.steps)):
        np.testing.assert_allclose(pose(moving["tool"], key), tip(scenario.robot, trace.q[k]))
        target = scenario.reference.placement(float(trace.tau[k])).homogeneous
        np.testing.assert_allclose(pose(moving["target"], key), target, atol=1e-9)
    seconds = moving["tool"][".position"][-1]["time"] / rate
    assert seconds == pytest.approx(trace.steps * trace.dt / 2)  # at twice the speed
    frames = len(moving["tool"][".position"])
    assert frames <= 60 * seconds + 2


def test_bodies_move_with_their_joints(pages: dict[str, str], runs: Path) -> None:
    """Every mesh of the arm has keyframes, and the last one is where its joint was at the end."""
    from dikbench.viewer.visuals import bodies

    recording = recording_of(runs, "reach")
    robot, moving = recording.scenario.robot, tracks(pages["reach"])[0]
    geometry = bodies(robot)
    model, data = robot.model, robot.model.createData()
    pin.forwardKinematics(model, data, recording.trace.q[-1])
    assert geometry.ngeoms == 7
    for body in geometry.geometryObjects:
        expected = data.oMi[body.parentJoint] * body.placement
        node = moving[f"robot/visuals/{body.name}"]
        np.testing.assert_allclose(pose(node, -1), expected.homogeneous, atol=1e-9)


def test_joints_show_their_limits(pages: dict[str, str], runs: Path) -> None:
    """At each keyframe one marker per joint is seen, that of its nearness; some turn red."""
    recording = recording_of(runs, "speed-sweep")
    moving, _ = tracks(pages["speed-sweep"])
    expected = nearness(recording.trace, recording.scenario.robot.limits)
    steps = [round(key["time"]) for key in moving["tool"][".position"]]
    for joint in range(3):
        shown = np.array(
            [
                [key["value"] for key in moving[f"joints/{joint}/{name}"][".visible"]]
                for name in ("inside", "near", "past")
            ]
        )
        np.testing.assert_array_equal(shown.sum(axis=0), 1)
        np.testing.assert_array_equal(shown.argmax(axis=0), expected[steps, joint])
    assert (expected[steps] == 2).any()


def test_paths_are_drawn(pages: dict[str, str], runs: Path) -> None:
    """The achieved path has a point per step and as many colours as there are kinds of nearness."""
    recording = recording_of(runs, "speed-sweep")
    commands = sent(pages["speed-sweep"])
    (line,) = (c for c in commands if c.get("path") == "/meshcat/achieved path/line")
    attributes = line["object"]["geometries"][0]["data"]["attributes"]
    points = np.frombuffer(attributes["position"]["array"].data, dtype=np.float32).reshape(-1, 3)
    ends = [tip(recording.scenario.robot, q)[:3, 3] for q in recording.trace.q]
    np.testing.assert_allclose(points, ends, atol=1e-6)
    colours = np.frombuffer(attributes["color"]["array"].data, dtype=np.float32).reshape(-1, 3)
    worst = nearness(recording.trace, recording.scenario.robot.limits).max(axis=1)
    assert len(np.unique(colours, axis=0)) == len(np.unique(worst)) > 1


def test_serving_ends_with_an_interrupt(runs: Path) -> None:
    """The address that is printed answers until Ctrl-C, which is no error and leaves no server."""
    pytest.importorskip("meshcat", reason=WITHOUT)
    name = recording_of(runs, "speed-sweep").id
    code = "from dikbench.cli import main; main()"
    process = subprocess.Popen(
        [sys.executable, "-c", code, "replay", name[:6]],
        cwd=runs,
        env={**os.environ, "BROWSER": "true"},
        stdout=subprocess.PIPE,
        text=True,
        preexec_fn=hear_ctrl_c,
    )
    assert process.stdout is not None
    try:
        lines = iter(process.stdout.readline, "")
        address = next(line for line in lines if line.startswith("http")).split()[0]
        with urllib.request.urlopen(address, timeout=30) as answer:
            assert answer.status == 200
        process.send_signal(signal.SIGINT)
        assert process.wait(timeout=30) == 0
    finally:
        process.kill()
        process.stdout.close()
        process.wait()
    with pytest.raises(OSError, match="refused"):
        urllib.request.urlopen(address, timeout=5)


def test_a_missing_extra_is_one_line(
    runs: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Without meshcat the command says what to install, and writes nothing."""
    monkeypatch.setitem(sys.modules, "meshcat", None)
    recording = recording_of(runs, "reach")
    results = runs / "runs" / "viewed"
    result = dikbench(recording.id, "--results", results, "--html", tmp_path / "x.html")
    assert result.exit_code == 2
    assert result.output.splitlines()[-1] == (
        "error: a replay needs meshcat: pip install 'dikbench[replay]'"
    )
    assert not (tmp_path / "x.html").exists()


def test_a_file_that_cannot_be_written_is_one_line(runs: Path, tmp_path: Path) -> None:
    """A folder that is not there is an error of one line."""
    pytest.importorskip("meshcat", reason=WITHOUT)
    recording = recording_of(runs, "speed-sweep")
    file = tmp_path / "missing" / "x.html"
    result = dikbench(recording.id, "--results", runs / "runs" / "viewed", "--html", file)
    assert result.exit_code == 2
    assert f"error: file {file}: No such file" in result.output
