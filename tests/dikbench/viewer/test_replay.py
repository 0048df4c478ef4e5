"""The replay as a file: everything is in it, and what moves is where the robot was."""

from __future__ import annotations

import base64
import os
import re
import signal
import subprocess
import sys
import urllib.request
from dataclasses import dataclass, field, replace
from itertools import pairwise
from pathlib import Path
from typing import Any

import msgspec
import numpy as np
import pinocchio as pin
import pytest
from click.testing import CliRunner, Result
from makers.commands import hear_ctrl_c

from dikbench.arrays import Array
from dikbench.cli import commands
from dikbench.metrics import motion_of
from dikbench.plugins.building import make_scenario
from dikbench.problem.constraints import CollisionConstraint
from dikbench.robots.collision.obstacles import BoxObstacle, CapsuleObstacle, SphereObstacle
from dikbench.robots.robot import Robot
from dikbench.simulation.trace import Trace
from dikbench.study.trial import Trial
from dikbench.viewer.legend import COLOURS, PATH_COLOURS, names_of
from dikbench.viewer.limit_use import Nearness, joint_nearness
from dikbench.viewer.moving_joints import joint_nodes
from dikbench.viewer.recording import Recording, find_recording
from dikbench.viewer.replay import write_replay
from dikbench.viewer.static_scene import surroundings

pytest.importorskip("viser", reason="viser is not installed: pip install 'dikbench[replay]'")

TOLERANCE = 1e-4
"""Largest error of a placement (m, rad): viser leaves out changes of a pose below 1e-5 of it."""

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


@dataclass
class Played:
    """What the client knows after the messages up to some time.

    Attributes:
        poses: position and quaternion w, x, y, z of nodes in their parents.
        props: properties of nodes.
    """

    poses: dict[str, tuple[list[float], list[float]]] = field(default_factory=dict)
    props: dict[str, dict[str, Any]] = field(default_factory=dict)

    def world(self, node: str) -> Array:
        """The placement of a node in the world, (4, 4)."""
        placement, parts = pin.SE3.Identity(), node.split("/")[1:]
        for k in range(len(parts)):
            at, (w, x, y, z) = self.poses.get("/" + "/".join(parts[: k + 1]), REST)
            placement = placement * pin.SE3(pin.Quaternion(w, x, y, z).matrix(), np.array(at))
        homogeneous: Array = placement.homogeneous
        return homogeneous

    def nodes(self, pattern: str) -> list[str]:
        """The names of nodes that match a pattern in full."""
        return [name for name in self.props if re.fullmatch(pattern, name)]


REST = [0.0, 0.0, 0.0], [1.0, 0.0, 0.0, 0.0]


@dataclass(frozen=True)
class Film:
    """The messages of a page with their times [s], and the arrays that they refer to."""

    messages: list[tuple[float, dict[str, Any]]]
    arrays: list[bytes]
    duration: float

    @classmethod
    def of(cls, page: str) -> Film:
        """Read what a page has embedded."""
        zstandard = pytest.importorskip("zstandard")
        (text,) = re.findall(r'__VISER_EMBED_DATA__="([^"]+)"', page)
        data = zstandard.ZstdDecompressor().decompress(base64.b64decode(text)[8:])
        end = 8 + int.from_bytes(data[:8], "little")
        content, arrays = msgspec.msgpack.decode(data[8:end]), []
        for length in content["binaryBufferLengths"]:
            end += -end % 8
            arrays.append(data[end : end + length])
            end += length
        return cls(content["messages"], arrays, content["durationSeconds"])

    @property
    def times(self) -> list[float]:
        """The times of the frames."""
        return sorted({time for time, _ in self.messages})

    def at(self, time: float) -> Played:
        """Play the messages up to a time."""
        played = Played()
        for then, message in self.messages:
            name, kind = message.get("name", ""), message["type"]
            if then > time:
                break
            if "props" in message:
                played.props[name] = dict(message["props"])
            elif kind == "SceneNodeUpdateMessage":
                played.props[name].update(message["updates"])
            elif kind == "SetPositionMessage":
                played.poses[name] = message["position"], played.poses.get(name, REST)[1]
            elif kind == "SetOrientationMessage":
                played.poses[name] = played.poses.get(name, REST)[0], message["wxyz"]
        return played

    def array(self, reference: dict[str, Any]) -> Any:
        """The array that a property refers to, flat."""
        return np.frombuffer(self.arrays[reference["__binary_index"]], reference["dtype"])


@pytest.fixture(scope="module")
def pages(runs: Path, tmp_path_factory: pytest.TempPathFactory) -> dict[str, str]:
    """The replays of each trial, twice as fast as the robot, and of "both" side by side."""
    folder, found = tmp_path_factory.mktemp("html"), {}
    ids = {family: recording_of(runs, family).id for family in EVERY}
    for name, trials in {**{f: [i] for f, i in ids.items()}, "both": [*ids.values()]}.items():
        file = folder / f"{name}.html"
        result = dikbench(
            *trials, "--results", runs / "runs" / "viewed", "--html", file, "--speed", 2
        )
        assert result.exit_code == 0, result.output
        assert result.output.splitlines()[-1] == str(file)
        assert "orange: links and path past a limit" in result.output
        found[name] = file.read_text(encoding="utf-8")
    return found


@pytest.fixture(scope="module")
def films(pages: dict[str, str]) -> dict[str, Film]:
    """What the pages have embedded."""
    return {name: Film.of(page) for name, page in pages.items()}


def placements(robot: Robot, q: Array) -> list[Array]:
    """Placements (4, 4) of all joints, the universe first, and of the task frame."""
    data = robot.model.createData()
    pin.framesForwardKinematics(robot.model, data, q)
    return [X.homogeneous for X in [*data.oMi, data.oMf[robot.frame_id]]]


def frames_and_instants(recording: Recording, film: Film) -> list[tuple[float, int]]:
    """The times of a replay at twice the speed with the control step that is shown then."""
    trace = recording.trace
    return [(time, min(round(2 * time / trace.dt), trace.steps)) for time in film.times]


@pytest.mark.parametrize("family", EVERY)
def test_a_page_needs_nothing_else(pages: dict[str, str], runs: Path, family: str) -> None:
    """No script, style or picture is fetched from anywhere, and the trial is named."""
    page = pages[family]
    assert not re.search(r"""<(script|link|img)[^>]+(src|href)\s*=\s*["']?(https?:)?//""", page)
    recording = recording_of(runs, family)
    assert str(recording.trial.scenario) in page
    assert f"<title>{recording.id}</title>" in page
    assert "past a limit" in page


@pytest.mark.parametrize("family", EVERY)
def test_links_tool_and_target_move_as_they_did(
    films: dict[str, Film], runs: Path, family: str
) -> None:
    """At the first, a middle and the last frame every joint, the tool and the target are there."""
    recording, film = recording_of(runs, family), films[family]
    scenario, trace = recording.scenario, recording.trace
    nodes = joint_nodes(scenario.robot.model, "/trial0/robot")
    frames = frames_and_instants(recording, film)
    for time, k in (frames[0], frames[len(frames) // 3], frames[-1]):
        played = film.at(time)
        *joints, tip = placements(scenario.robot, trace.q[k])
        for node, joint in zip(nodes, joints, strict=True):
            np.testing.assert_allclose(played.world(node), joint, atol=TOLERANCE)
        np.testing.assert_allclose(played.world(f"{nodes[-1]}/tool"), tip, atol=TOLERANCE)
        target = scenario.target(float(trace.tau[k]))[0].homogeneous
        np.testing.assert_allclose(played.world("/trial0/target"), target, atol=TOLERANCE)
    seconds = frames[-1][0]
    assert seconds == pytest.approx(trace.steps * trace.dt / 2)
    assert len(frames) <= 30 * seconds + 2
    assert film.duration > seconds  # a rest before it begins anew


def test_links_show_their_limits(films: dict[str, Film], runs: Path) -> None:
    """At each frame a link has the colour of the worst since the frame before; some are past."""
    recording, film = recording_of(runs, "speed-sweep"), films["speed-sweep"]
    frames = frames_and_instants(recording, film)
    expected = joint_nearness(recording.trace, recording.scenario, np.array([k for _, k in frames]))
    bodies = [f"{node}/body" for node in joint_nodes(recording.scenario.robot.model)[1:]]
    for (time, _), states in zip(frames, expected, strict=True):
        played = film.at(time)
        found = [tuple(played.props[f"/trial0{body}"]["color"]) for body in bodies]
        assert found == [COLOURS[Nearness(state)] for state in states]
        (label,) = played.nodes("/trial0/label")
        said = played.props[label]["text"]
        assert f"  {2 * time:.2f} s" in said
        assert ("past its limit: speed" in said) == (states == Nearness.PAST).any()
    assert (expected == Nearness.PAST).any()


def test_paths_are_drawn(films: dict[str, Film], runs: Path) -> None:
    """The achieved path has a point per step and the colours of the nearness of each."""
    recording, film = recording_of(runs, "speed-sweep"), films["speed-sweep"]
    line = film.at(0.0).props["/trial0/achieved"]
    points = film.array(line["points"]).reshape(-1, 2, 3)
    ends = [placements(recording.scenario.robot, q)[-1][:3, 3] for q in recording.trace.q]
    np.testing.assert_allclose(points[:, 0], ends[:-1], atol=1e-6)
    np.testing.assert_allclose(points[:, 1], ends[1:], atol=1e-6)
    worst = joint_nearness(recording.trace, recording.scenario).max(axis=1)
    expected = [PATH_COLOURS[Nearness(state)] for state in worst[:-1]]
    np.testing.assert_array_equal(film.array(line["colors"]).reshape(-1, 2, 3)[:, 0], expected)


def test_two_trials_stand_side_by_side(films: dict[str, Film]) -> None:
    """Each moves in its place as it does alone, and the shorter waits for the longer."""
    both = films["both"]
    ends = [film.times[-1] for film in (films["speed-sweep"], films["reach"])]
    assert ends[0] != ends[1]
    assert both.times[-1] == pytest.approx(max(ends))
    at_end, start = both.at(both.times[-1]), both.at(0.0)
    offset = start.world("/trial1")[:3, 3] - start.world("/trial0")[:3, 3]
    assert np.linalg.norm(offset) > 0.5
    for number, family in enumerate(EVERY):
        alone = films[family].at(films[family].times[-1])
        (tool,) = alone.nodes("/trial0/robot/.*/tool")
        place = np.linalg.inv(at_end.world(f"/trial{number}"))
        found = place @ at_end.world(tool.replace("/trial0", f"/trial{number}"))
        np.testing.assert_allclose(found, alone.world(tool), atol=TOLERANCE)


@pytest.mark.parametrize("speed", ["nan", "inf", "0", "-1"])
def test_a_speed_that_is_none_is_one_line(speed: str) -> None:
    """No replay stands still, runs backwards or is over at once."""
    result = dikbench("a", "--speed", speed)
    assert result.exit_code == 2
    assert "--speed" in result.output.splitlines()[-1]
    assert result.output.splitlines()[-1].lower().startswith("error: ")


def test_what_stands_in_the_way_and_what_is_carried(tmp_path: Path) -> None:
    """Obstacles and payload are where the scenario has them; a line joins the nearest bodies."""
    recordings = [by_hand("obstacle[robot=planar3r]"), by_hand("torque-limited[robot=ur5]")]
    write_replay(recordings, 1.0, tmp_path / "x.html")
    page = (tmp_path / "x.html").read_text(encoding="utf-8")
    assert "violet: obstacles" in page
    assert "green: what is carried" in page
    film = Film.of(page)
    scenario, trace = recordings[0].scenario, recordings[0].trace
    distances = motion_of(trace, scenario).distances
    (obstacle,) = scenario.obstacles
    assert isinstance(obstacle, CapsuleObstacle | SphereObstacle)
    _, placement = obstacle.geometry()
    for time in (0.0, film.times[-1]):
        played = film.at(time)
        drawn = played.props["/trial0/obstacles/0"]
        assert drawn["radius"] == pytest.approx(obstacle.radius)
        at = np.linalg.inv(played.world("/trial0")) @ played.world("/trial0/obstacles/0")
        np.testing.assert_allclose(at, placement.homogeneous, atol=1e-6)
        a, b = film.array(played.props["/trial0/nearest"]["points"]).reshape(2, 3)
        distance = distances[min(round(time / trace.dt), trace.steps)]
        assert np.linalg.norm(b - a) == pytest.approx(abs(distance), abs=1e-4)
        assert f"distance {1000 * distance:.0f} mm" in played.props["/trial0/label"]["text"]
        (ball,) = played.nodes("/trial1/robot/.*/tool/payload")
        assert played.props[ball]["radius"] == 0.05
    assert not played.nodes("/trial0/robot/.*/payload")
    assert not played.nodes("/trial1/obstacles.*")


def test_obstacles_of_every_shape() -> None:
    """A ball, a capsule along its segment, and a turned box are drawn where they are."""
    turned = ((0.0, -1.0, 0.0), (1.0, 0.0, 0.0), (0.0, 0.0, 1.0))
    obstacles = (
        SphereObstacle((1.0, 2.0, 3.0), 0.2),
        CapsuleObstacle((0.0, 1.0, 0.0), (0.0, 1.0, 2.0), 0.1),
        BoxObstacle((3.0, 0.0, 0.0), (0.1, 0.2, 0.3), turned),
    )
    scenario = make_scenario("reach[robot=planar3r,duration=0.2]")
    scenario = replace(scenario, constraints=(CollisionConstraint(obstacles),))
    film = Film([(0.0, message) for message in surroundings(scenario).messages], [], 0.0)
    played = film.at(0.0)
    ball, capsule, box = (f"/obstacles/{number}" for number in range(3))
    assert played.props[ball]["radius"] == played.props[capsule]["radius"] * 2 == 0.2
    np.testing.assert_allclose(played.world(ball)[:3, 3], [1, 2, 3])
    assert played.props[capsule]["height"] == 2
    ends = [played.world(f"{capsule}/{end}")[:3, 3] for end in ("start", "end")]
    np.testing.assert_allclose(ends, [[0, 1, 0], [0, 1, 2]], atol=1e-12)
    assert played.props[box]["dimensions"] == [0.1, 0.2, 0.3]
    np.testing.assert_allclose(played.world(box)[:3, :3], turned, atol=1e-12)
    np.testing.assert_allclose(played.world(box)[:3, 3], [3, 0, 0])


def test_names_tell_trials_apart() -> None:
    """Formulations name trials; where they are the same, so does what differs of the trials."""
    recording = by_hand("speed-sweep[robot=planar3r]")
    other = replace(recording, trial=replace(recording.trial, reference="path", seed=3))
    qp = replace(recording, trial=Trial.of("qp", "reach", "daqp"))
    assert names_of([recording, qp]) == ["pinv", "qp with daqp"]
    assert names_of([recording, other]) == ["pinv, by time, seed 0", "pinv, by path, seed 3"]
    assert names_of([recording, recording]) == ["pinv", "pinv"]


def by_hand(selector: str) -> Recording:
    """A recording of a second of the exact motion of a scenario."""
    scenario = make_scenario(selector)
    assert scenario.oracle is not None
    q = scenario.oracle[: round(1 / scenario.dt)]
    n, nv = len(q) - 1, scenario.robot.nv
    none, codes, tau = np.zeros(n), np.zeros(n, dtype=int), scenario.dt * np.arange(n + 1.0)
    steps = [pin.difference(scenario.robot.model, *pair) for pair in pairwise(q)]
    v: Array = np.array(steps).reshape(n, nv) / scenario.dt
    trace = Trace(
        scenario.dt, q, tau, np.zeros((n, 6)), v, v, codes, codes, codes, codes, *4 * (none,)
    )
    trial = Trial.of("pinv", selector)
    return Recording("by-hand", trial, "ok", trace, scenario)


def test_three_trials_are_one_too_many(runs: Path) -> None:
    """More than two trials are an error of one line."""
    result = dikbench("a", "b", "c")
    assert result.exit_code == 2
    assert result.output == "error: replay takes one trial, or two side by side; got 3\n"


def test_serving_ends_with_an_interrupt(runs: Path) -> None:
    """The address that is printed answers until Ctrl-C, which is no error and leaves no server."""
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
    """Without viser the command says what to install, and writes nothing."""
    monkeypatch.setitem(sys.modules, "viser", None)
    recording = recording_of(runs, "reach")
    results = runs / "runs" / "viewed"
    result = dikbench(recording.id, "--results", results, "--html", tmp_path / "x.html")
    assert result.exit_code == 2
    assert result.output.splitlines()[-1] == (
        "error: a replay needs viser: pip install 'dikbench[replay]'"
    )
    assert not (tmp_path / "x.html").exists()


def test_a_file_that_cannot_be_written_is_one_line(runs: Path, tmp_path: Path) -> None:
    """A folder that is not there is an error of one line."""
    recording = recording_of(runs, "speed-sweep")
    file = tmp_path / "missing" / "x.html"
    result = dikbench(recording.id, "--results", runs / "runs" / "viewed", "--html", file)
    assert result.exit_code == 2
    assert f"error: file {file}: No such file" in result.output
