from __future__ import annotations

import json
import os
import re
import shutil
import signal
import sqlite3
import subprocess
import sys
import time
from collections.abc import Sequence
from pathlib import Path
from typing import get_args

import pandas as pd
import pytest
from click.testing import CliRunner, Result
from makers.runs import without_figures, without_workers
from makers.urdfs import SIX, write_arm

from dikbench.cli import commands
from dikbench.cli.listing import listing
from dikbench.metrics import METRICS, Outcome
from dikbench.plugins.finding import plugins
from dikbench.report import write
from dikbench.scenario.plant import REFERENCE_MODES
from dikbench.scenario.witness import Feasible

FORMULATION = '''
from __future__ import annotations
from dataclasses import dataclass

@dataclass(frozen=True)
class MyLaw:
    """The transpose of the Jacobian.

    Source: a test.
    """

    gain: float = 1.0

    def velocity(self, problem, solve):
        return self.gain * problem.primary.J.T @ problem.primary.V
'''


def dikbench(*arguments: str, cwd: Path) -> subprocess.CompletedProcess[str]:
    """Run the command line in a process of its own."""
    return subprocess.run(
        [sys.executable, "-c", "from dikbench.cli import main; main()", *arguments],
        capture_output=True,
        text=True,
        cwd=cwd,
        timeout=300,
        check=False,
    )


def in_process(*arguments: str) -> Result:
    """Run the command line in this process, where all is imported already; only workers start."""
    handler = signal.getsignal(signal.SIGTERM)  # `dikbench run` sets its own
    try:
        return CliRunner().invoke(commands, [*arguments])
    finally:
        signal.signal(signal.SIGTERM, handler)


def test_help_does_not_import_anything_heavy() -> None:
    """`dikbench --help` imports neither numpy nor Pinocchio nor pandas."""
    code = (
        "import sys\n"
        "from dikbench.cli import commands\n"
        "commands.main(['--help'], standalone_mode=False)\n"
        "heavy = {'numpy', 'pinocchio', 'pandas', 'scipy', 'qpsolvers', 'cvxpy', 'matplotlib'}\n"
        "assert not heavy & set(sys.modules), heavy & set(sys.modules)\n"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    assert "run" in done.stdout


ON_REACH = ("run", "--scenario", "reach")
"""Of one scenario: those of a whole study would be built before some faults are found."""

MALFORMED = [
    (("run", "nosuch"), ("nosuch", "quick")),
    ((*ON_REACH, "--formulation", "dls[damping=many]"), ("damping", "a number, finite and")),
    (("run", "--formulation", "dls[dampin=1]"), ("dampin", "valid: damping")),
    (("run", "--formulation", "nofile.py:Formulation"), ("nofile.py",)),
    ((*ON_REACH, "--solver", "osqp[eps=1]"), ("eps", "eps_abs")),
    (("run", "--scenario", "reach[robot=bad.urdf,frame=tip]"), ("bad.urdf", "URDF")),
    (("run", "--scenario", "near-miss[robot=talos,singularity=wrist]"), ("wrist", "elbow")),
    (("run", "--scenario", "reach[gain=1||2]"), ("gain", "empty")),
    ((*ON_REACH, "--plant", "ideal[delay=-1]"), ("delay=-1", "0 to")),
    ((*ON_REACH, "train", "--seed", "0"), ("seed 0", "1 to 99")),
    (("show", "near-miss", "--figure", "a.gif"), ("a.gif", ".svg, .png, .pdf")),
    (("show", "near-miss", "--figure", "no/such/a.png"), ("no/such/a.png", "No such file")),
    (("show", "dls", "--figure", "a.png"), ("dls", "dikbench list scenarios")),
    (("run", "--scenario", "reach[duration=1e15]"), ("steps", "valid")),
    ((*ON_REACH, "--plant", "perfect"), ("perfect", "ideal")),
    (("run", "--reference", "space"), ("space", "path")),
    (("run", "--seed", "-1"), ("-1",)),
    ((*ON_REACH, "--out", "afile/inside", "--formulation", "dls"), ("afile/inside",)),
    (("recompute", "nowhere"), ("no results", "nowhere")),
    (("list", "laws"), ("laws", "formulations")),
    (("show", "nowhere.urdf"), ("robot file not found: nowhere.urdf",)),
    (("show", "bad.urdf"), ("robot file bad.urdf is not a URDF, which is XML",)),
    (("show", "csv[file=none.csv]"), ("none.csv",)),
    (("check", "csv"), ("'file' must be given; valid: csv[file=...], a text",)),
    (("run", "--scenario", "csv"), ("valid: csv[file=...], a text",)),
    (("show", "nothing"), ("nothing", "valid", "dikbench list")),
    (("show", "dls[dampin=1]"), ("dampin", "valid: damping")),
    (("show", "dls[damping=-1]"), ("damping=-1.0", "finite and at least 0")),
    (("show", "osqp[eps=1]"), ("eps", "eps_abs")),
    (("show", "saturating[delay=x]"), ("delay='x'", "a whole number, 0 to 1000 [steps]")),
    (("show", "panda[x=1]"), ("unknown parameter of robot panda 'x'", "valid: acceleration")),
    (("show", "nowhere.xacro[lock=j1]"), ("robot file not found: nowhere.xacro",)),
    (("show", "panda[lock=elbow]"), ("unknown joint 'elbow' of robot panda", "panda_joint1")),
    (("show", "quick[x=1]"), ("quick has no parameters", "valid in brackets")),
    (("show", "lag_max_s[x=1]"), ("lag_max_s has no parameters",)),
    (("show", "nofile.py:Family"), ("error: file not found: nofile.py",)),
    (
        ("show", "bad.py"),
        ("bad.py names a file without a class; valid: bad.py:Law, bad.py:Thawed, bad.py:Way",),
    ),
    (("check", "bad.py"), ("valid: bad.py:Law",)),
    (("run", "--scenario", "bad.py"), ("bad.py:Way",)),
    (("run", "--formulation", "bad.py"), ("bad.py:Law",)),
    ((*ON_REACH, "--formulation", "bad.py:Thawed"), ("bad.py:Thawed", "@dataclass(frozen=True)")),
    (
        ("run", "--formulation", "bad.py:Low"),
        ("'Low'", "did you mean 'Law'", "valid: Law, Thawed, Way"),
    ),
    (("run", "bad.toml"), ("study bad.toml: cells[0].formulations: ", "damping='x'", "a number")),
    (("--plnt",), ("--plnt",)),
]
SHOWN = {
    "qp": "min_v",
    "near-miss[miss=0.05]": "required speed over limit",
    "near-miss": (
        "miss = 0.02: a number, 0 or 0.001 to 0.2 [m; rad]  (instances: 0.002 to 0.05, logarithmic)"
    ),
    "dls": "damping = 0.05: a number, finite and at least 0  (tuned: 0.001 to 0.3, logarithmic)",
    "dls[damping=0.2]": "damping = 0.2 (default: 0.05): a number, finite and at least 0",
    "osqp": "eps_abs",
    "osqp[eps_abs=1e-6]": "selected: eps_abs=1e-6",
    "ideal[delay=2]": "delay = 2 (default: 0): a whole number, 0 to 1000 [steps]",
    "saturating": "Clips each joint",
    "oracle": "the exact joint motion",
    "panda": "panda_hand_tcp",
    "direction_error_max_rad": "unit: rad",
    "quick": "[[cells]]",
    "csv": "file must be given: csv[file=...]",
    "csv[dt=0.02]": "file must be given: csv[dt=0.02,file=...]",
    "needs.py:Needs": "strength must be given: needs.py:Needs[strength=...]",
    "reach": "Its target is at rest: how to get to it is up to a formulation.",
    "near-miss[miss=0.1]": "feasible unknown: neither a motion is known nor a proof",
    "near-miss[miss=0.03]": "reference path: the reference moves on with the progress",
    "near-miss[miss=0.04]": "outcome left-path: farther from the path",
    "ur5": "wrist_3_joint (5): turns; position -6.283 to 6.283 rad; speed 3.2 rad/s; acceleration",
    "gantry.urdf": "rail (0): slides; position -1 to 2 m; speed 0.5 m/s; torque or force 30 N",
    "././gantry.urdf": "flap follows rail",
    "./gantry.urdf": "wheel (1): turns without end; position -inf to inf rad; speed 2 rad/s",
}

ONE_AFTER_THE_OTHER = """
import json, os, sys, traceback
from pathlib import Path
from dikbench.cli import main

streams, folder = (os.dup(1), os.dup(2)), Path.cwd()
for number, arguments in enumerate(json.loads(sys.argv[1])):
    os.chdir(folder / str(number) / "cwd")
    for stream, name in ((1, "stdout"), (2, "stderr")):
        os.dup2(os.open(f"../{name}", os.O_WRONLY | os.O_CREAT), stream)
    sys.argv, code = ["dikbench", *arguments], None
    try:
        main()
    except SystemExit as left:
        code = left.code
    except BaseException:
        traceback.print_exc()
    sys.stdout.flush()
    Path("../code").write_text(json.dumps(code))
for stream, kept in enumerate(streams, start=1):
    os.dup2(kept, stream)
"""
"""Runs many commands in one process, each in a folder of its own: most of the time of a command
that ends in an error is taken by imports."""


CLASSES = """
from dataclasses import dataclass
from scenarios.reach import Reach

@dataclass(frozen=True)
class Law:
    def velocity(self, problem, solve):
        return problem.q

@dataclass
class Thawed:
    def velocity(self, problem, solve):
        return problem.q

@dataclass(frozen=True, kw_only=True)
class Way(Reach):
    pass
"""
SWEEP = """
description = "a wrong value in a list"
scenarios = ["reach"]
[[cells]]
formulations = ["dls[damping=0.1|x|0.2]"]
"""

UNTIMED = """
description = "a study without times"
scenarios = ["reach"]
[[cells]]
formulations = ["dls"]
"""
NEEDS = """
from dataclasses import dataclass

@dataclass(frozen=True)
class Needs:
    strength: float

    def velocity(self, problem, solve):
        return problem.q
"""
GANTRY = """
<robot name="gantry">
  <link name="floor"/><link name="cart"/><link name="hand"/><link name="camera"/>
  <joint name="rail" type="prismatic">
    <parent link="floor"/><child link="cart"/><axis xyz="1 0 0"/>
    <limit lower="-1" upper="2" velocity="0.5" effort="30"/>
  </joint>
  <joint name="wheel" type="continuous">
    <parent link="cart"/><child link="hand"/><axis xyz="0 0 1"/><limit velocity="2" effort="5"/>
  </joint>
  <link name="mirror"/>
  <joint name="flap" type="revolute">
    <parent link="cart"/><child link="mirror"/><axis xyz="0 1 0"/><mimic joint="rail"/>
    <limit lower="-1" upper="2" velocity="2" effort="5"/>
  </joint>
  <joint name="mount" type="fixed"><parent link="cart"/><child link="camera"/></joint>
</robot>
"""


def run_all(
    folder: Path, commands: Sequence[Sequence[str]], path: Path | None = None
) -> list[Path]:
    """Run commands; of each a folder with `stdout`, `stderr`, `code`, and `cwd`, where it ran."""
    folders = [folder / str(number) for number in range(len(commands))]
    for each in folders:
        (each / "cwd").mkdir(parents=True)
        (each / "cwd" / "bad.urdf").write_text("<robot name='x'>")
        (each / "cwd" / "afile").touch()
        (each / "cwd" / "bad.py").write_text(CLASSES)
        (each / "cwd" / "bad.toml").write_text(SWEEP)
        (each / "cwd" / "untimed.toml").write_text(UNTIMED)
        (each / "cwd" / "needs.py").write_text(NEEDS)
        (each / "cwd" / "gantry.urdf").write_text(GANTRY)
    command = [sys.executable, "-c", ONE_AFTER_THE_OTHER, json.dumps(commands)]
    environment = os.environ if path is None else {**os.environ, "PYTHONPATH": str(path)}
    subprocess.run(command, cwd=folder, env=environment, check=True, timeout=600)
    return folders


@pytest.fixture(scope="module")
def refused(tmp_path_factory: pytest.TempPathFactory) -> list[Path]:
    """What came of the malformed commands, in their order."""
    return run_all(tmp_path_factory.mktemp("refused"), [arguments for arguments, _ in MALFORMED])


@pytest.mark.parametrize("number", range(len(MALFORMED)), ids=lambda n: " ".join(MALFORMED[n][0]))
def test_malformed_input_is_one_line_and_exit_code_two(refused: list[Path], number: int) -> None:
    """Whatever is wrong with a command: one line, exit code 2, no traceback, nothing written."""
    folder, (_, expected) = refused[number], MALFORMED[number]
    said = (folder / "stderr").read_text()
    assert (folder / "code").read_text() == "2", said
    assert (folder / "stdout").read_text() == ""
    assert len(said.strip().splitlines()) == 1, said
    assert said.startswith("error: ")
    for part in expected:
        assert part in said
    assert len(said) < 350
    written = {path.name for path in (folder / "cwd").rglob("*")} - {"__pycache__"}
    assert {name for name in written if not name.endswith(".pyc")} == {
        "afile",
        "bad.py",
        "bad.toml",
        "bad.urdf",
        "gantry.urdf",
        "needs.py",
        "untimed.toml",
    }


def test_a_failed_command_touches_no_earlier_results(results: Path, tmp_path: Path) -> None:
    """A malformed second run leaves the files of the first as they were."""
    out = tmp_path / "out"
    shutil.copytree(results, out)
    before = {path: path.read_bytes() for path in out.rglob("*") if path.is_file()}
    assert len(before) > 10
    assert in_process("run", "--formulation", "dlss", "--out", str(out)).exit_code == 2
    assert {path: path.read_bytes() for path in out.rglob("*") if path.is_file()} == before


def test_a_plugin_of_another_project_is_listed_and_runs(tmp_path: Path) -> None:
    """A project with its own entry points adds a law and a family without touching dikbench."""
    site = tmp_path / "site"
    info = site / "my_project-1.0.dist-info"
    info.mkdir(parents=True)
    (site / "my_laws.py").write_text(FORMULATION + '\nFORMULATIONS = {"my-formulation": MyLaw}\n')
    (site / "my_scenarios.py").write_text(
        'from scenarios.reach import Reach\nSCENARIOS = {"my-family": Reach(distance=0.05)}\n'
    )
    (info / "METADATA").write_text("Metadata-Version: 2.1\nName: my-project\nVersion: 1.0\n")
    (info / "entry_points.txt").write_text(
        "[dikbench.formulations]\nmine = my_laws\n[dikbench.scenarios]\nmine = my_scenarios\n"
    )
    scenario = "my-family[distance=0.1,duration=0.2]"
    study = ("run", "untimed.toml", "--scenario", scenario)
    run = (*study, "--formulation", "my-formulation[gain=2]")
    how = (*SHORT[4:], "--jobs", "1", "--traces", "none", "--out", "out")
    listed, ran = run_all(tmp_path, [("list",), (*run, *how)], path=site)
    assert "my-formulation" in (listed / "stdout").read_text()
    assert "my-family" in (listed / "stdout").read_text()
    assert (ran / "code").read_text() == "null", (ran / "stderr").read_text()
    trials = pd.read_csv(ran / "cwd" / "out" / "trials.csv")
    assert list(trials["formulation"]) == ["my-formulation[gain=2]"]
    assert list(trials["status"]) == ["ok"]


def test_a_law_and_a_family_in_files_run_without_packaging(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """`path/to/file.py:Class` is resolved in each worker from its text, with parameters.

    The family is shown and reported as one with a name is.
    """
    monkeypatch.chdir(tmp_path)
    Path("unpackaged_law.py").write_text(FORMULATION)
    Path("unpackaged_reach.py").write_text(
        "from dataclasses import dataclass\n"
        "from scenarios.reach import Reach\n"
        "@dataclass(frozen=True, kw_only=True)\n"
        "class Short(Reach):\n"
        '    """A short reach."""\n'
        "    distance: float = 0.05\n"
        "    duration: float = 0.5\n"
    )
    shown = in_process("show", "unpackaged_reach.py:Short")
    assert shown.exit_code == 0, shown.output
    assert "distance = 0.05: a number, 0.01 to 0.3 [m]" in shown.output
    law = "unpackaged_law.py:MyLaw"
    with without_figures():
        done = in_process(
            "run", "--formulation", law, "--formulation", f"{law}[gain=2]",
            "--scenario", "unpackaged_reach.py:Short[distance=0.02|0.1]",
            "--plant", "ideal", "--reference", "time", "--jobs", "1", "--out", "out",
        )  # fmt: skip
    assert done.exit_code == 0, done.output
    trials = pd.read_csv(tmp_path / "out" / "trials.csv")
    assert list(trials["status"]) == ["ok"] * 4
    progress = trials.groupby("formulation")["progress_mean"].mean()
    assert progress[f"{law}[gain=2]"] > progress[law]
    assert "A short reach" in (tmp_path / "out" / "report.html").read_text()


def test_show_prints_one_thing_in_full(tmp_path: Path) -> None:
    """`dikbench show` knows formulations, scenarios, solvers, robots, metrics and studies."""
    folders = run_all(tmp_path, [("show", name) for name in SHOWN])
    for folder, expected in zip(folders, SHOWN.values(), strict=True):
        assert (folder / "code").read_text() in {"0", "null"}, (folder / "stderr").read_text()
        assert expected in (folder / "stdout").read_text()


SHORT = (
    "--formulation", "dls", "--scenario", "reach[duration=0.2]", "--plant", "ideal",
    "--reference", "time",
)  # fmt: skip


def test_time_and_status_work_on_a_folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Times alone first, then the trials, then what is there."""
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(write, "write_report", lambda folder: "")
    with without_workers():
        _times_and_status(tmp_path)


def _times_and_status(folder: Path) -> None:
    timed = in_process("time", *SHORT, "--out", "out")
    assert timed.exit_code == 0, timed.output
    assert "Timing of one call" in timed.stdout
    assert list(pd.read_csv(folder / "out" / "timing.csv")["formulation"]) == ["dls"]
    missing = in_process("status", "out")
    assert missing.stdout.split() == ["1", "missing", "1", "planned"]
    assert in_process("run", *SHORT, "--out", "out", "--jobs", "1").exit_code == 0
    assert in_process("status", "out").stdout.split() == ["1", "ok", "1", "planned"]
    again = in_process("run", *SHORT, "--out", "out")
    assert "1 of 1 trials are done" in again.stderr
    nothing = in_process("status", "nosuch")
    assert nothing.exit_code == 2
    assert nothing.stderr.startswith("error: no results in")
    assert not (folder / "nosuch").exists()


TIRES = """
from dataclasses import dataclass

@dataclass(frozen=True)
class Tires:
    def velocity(self, problem, solve):
        with open("steps", "a") as file:
            file.write(".")
            loops = file.tell() > 5 * 20
        while loops:
            pass
        return problem.primary.J.T @ problem.primary.V
"""
"""Loops for ever after five trials of twenty steps."""


def test_ctrl_c_keeps_what_is_finished_and_says_how_to_go_on(tmp_path: Path) -> None:
    """Exit code 130, the rows so far, and the command; nobody goes on with what loops for ever."""
    (tmp_path / "tires.py").write_text(TIRES)
    arguments = ["run", "--formulation", "tires.py:Tires", *SHORT[2:], "--out", "out"]
    arguments += ["--jobs", "1"]
    for seed in range(8):
        arguments += ["--seed", str(seed)]
    process = subprocess.Popen(
        [sys.executable, "-c", "from dikbench.cli import main; main()", *arguments],
        stderr=subprocess.PIPE,
        stdout=subprocess.DEVNULL,
        text=True,
        cwd=tmp_path,
        # A shell starts what is in the background deaf to Ctrl-C, which children inherit.
        preexec_fn=lambda: signal.signal(signal.SIGINT, signal.default_int_handler),
    )
    store = tmp_path / "out" / "results.sqlite"
    for _ in range(600):
        time.sleep(0.1)
        if store.exists():
            try:
                with sqlite3.connect(store) as database:
                    if database.execute("SELECT COUNT(*) FROM trials").fetchone()[0] >= 5:
                        break
            except sqlite3.OperationalError:
                continue  # its tables are not there yet
    process.send_signal(signal.SIGINT)
    _, said = process.communicate(timeout=60)
    assert process.returncode == 130, said
    assert "5 of 8 trials are done and kept; to continue: dikbench run" in said
    assert "Traceback" not in said
    assert len(pd.read_csv(tmp_path / "out" / "trials.csv")) == 5
    _assert_nobody_is_left_in(tmp_path)


@pytest.mark.skipif(not Path("/dev/shm").is_dir() or os.geteuid() != 0, reason="needs a tmpfs")
def test_a_full_disk_is_one_line_and_what_was_committed_is_kept(tmp_path: Path) -> None:
    """On a file system of one megabyte."""
    disk = tmp_path / "disk"
    disk.mkdir()
    mount = ["mount", "-t", "tmpfs", "-o", "size=1m", "tmpfs", str(disk)]
    if subprocess.run(mount, capture_output=True, check=False).returncode:
        pytest.skip("mounting is not allowed here")
    try:
        arguments = [
            "run",
            *SHORT,
            "--scenario",
            "reach",
            "--out",
            str(disk / "out"),
            "--jobs",
            "1",
        ]
        for seed in range(30):
            arguments += ["--seed", str(seed)]
        done = dikbench(*arguments, cwd=tmp_path)
        assert done.returncode == 2, done.stderr
        last = done.stderr.splitlines()[-1]
        assert last.startswith("error: ")
        assert "space" in last or "full" in last
        assert "Traceback" not in done.stderr
        shutil.copytree(disk / "out", tmp_path / "copy")
        with sqlite3.connect(tmp_path / "copy" / "results.sqlite") as database:
            assert database.execute("PRAGMA integrity_check").fetchone() == ("ok",)
            assert database.execute("SELECT COUNT(*) FROM trials").fetchone()[0] > 0
    finally:
        subprocess.run(["umount", str(disk)], check=True)


SPINNING = """
from dataclasses import dataclass

@dataclass(frozen=True)
class Spin:
    def velocity(self, problem, solve):
        open("spinning", "w").close()
        while True:
            pass
"""


@pytest.mark.skipif(sys.platform != "linux", reason="other systems have no such signal")
@pytest.mark.parametrize("how", [signal.SIGKILL, signal.SIGTERM])
def test_no_worker_outlives_its_driver(tmp_path: Path, how: signal.Signals) -> None:
    """However the driver ends, a formulation that loops for ever ends with it; ctrl-c as well."""
    (tmp_path / "spin.py").write_text(SPINNING)
    arguments = ["run", "--formulation", "spin.py:Spin", *SHORT[2:], "--out", "out", "--jobs", "1"]
    process = subprocess.Popen(
        [sys.executable, "-c", "from dikbench.cli import main; main()", *arguments],
        stderr=subprocess.DEVNULL,
        stdout=subprocess.DEVNULL,
        cwd=tmp_path,
    )
    for _ in range(1200):
        if (tmp_path / "spinning").exists() or process.poll() is not None:
            break
        time.sleep(0.1)
    at_work = _processes_in(tmp_path)
    process.send_signal(how)
    process.wait(timeout=60)
    assert len(at_work) >= 2
    _assert_nobody_is_left_in(tmp_path)


def _assert_nobody_is_left_in(folder: Path) -> None:
    """Wait a while for the processes whose working folder this is."""
    for _ in range(300):
        if not _processes_in(folder):
            break
        time.sleep(0.1)
    assert not _processes_in(folder)


def _processes_in(folder: Path) -> list[str]:
    """The processes whose working folder this is."""
    found = []
    for process in Path("/proc").glob("[0-9]*"):
        try:
            if os.readlink(process / "cwd") == str(folder):
                found.append(process.name)
        except OSError:  # gone, or not ours
            continue
    return found


def test_the_frames_of_a_robot_are_shown_with_what_moves_them(tmp_path: Path) -> None:
    """Those of a tree, in the order of the file."""
    (tmp_path / "gantry.urdf").write_text(GANTRY)
    shown = in_process("show", str(tmp_path / "gantry.urdf"))
    assert shown.exit_code == 0
    (frames,) = [line for line in shown.output.splitlines() if "camera" in line]
    found = dict(re.findall(r"(\w+) \((\d)\)", frames))
    assert {k: found[k] for k in ("floor", "cart", "hand", "camera")} == {
        "floor": "0", "cart": "1", "hand": "2", "camera": "1",
    }  # fmt: skip


def test_a_robot_is_shown_with_what_a_family_can_be_given(tmp_path: Path) -> None:
    """Rows, locked joints and limits by hand, of a file and of the catalogue."""
    arm = write_arm(tmp_path, SIX)
    shown = in_process("show", f"{arm}[frame=tool,rows=xyz,lock=j2=0.5 j6,acceleration=7]").output
    assert "a robot from a URDF; task frame tool\n" in shown
    assert "asked for: rows=xyz; its 4 joints move xyzrxryrz\n" in shown
    assert "4 velocities" in shown
    assert "j1 (0): turns; position -3 to 3 rad; speed 2 rad/s; acceleration 7 rad/s^2" in shown
    assert "\n    j2 (" not in shown
    assert "acceleration limits (given by hand)" in shown
    assert "6 velocities" in in_process("show", "panda[lock=panda_joint1]").output


def test_every_word_of_a_verdict_is_explained() -> None:
    """What a scenario's trials may be called, wherever `show` is asked."""
    shown = in_process("show", "near-miss").output
    words = {"feasible": get_args(Feasible), "reference": REFERENCE_MODES, "outcome": Outcome}
    for of, each in words.items():
        for word in each:
            assert f"\n  {of} {word}: " in shown


def test_a_scenario_is_shown_with_its_certificate_and_its_picture(tmp_path: Path) -> None:
    """The claims, what the motion asks for, what a seed perturbs; and a figure of its kind."""
    begins = {"svg": b"<?xml", "png": bytes.fromhex("89504e470d0a1a0a"), "pdf": b"%PDF"}
    shown = ("show", "near-miss[robot=panda,miss=0.01]", "--figure")
    for ending, head in begins.items():
        done = in_process(*shown, str(tmp_path / f"picture.{ending}"))
        assert done.exit_code == 0, done.output
        for part in (
            "Certificate of near-miss[robot=panda,miss=0.01]:",
            "smallest singular value (m, rad): ",
            "margin to the position limits [rad]: ",
            "required speed over limit: up to ",
            "reach from the first joint [m]: ",
            "A seed perturbs: start by up to 0.1 rad per joint, timing by up to 10 %.",
            f"picture.{ending}",
        ):
            assert part in done.stdout
        content = (tmp_path / f"picture.{ending}").read_bytes()
        assert content.startswith(head)
        assert len(content) > 5000


def test_every_listed_scenario_says_what_it_provokes_and_which_metric_shows_it() -> None:
    """One line each, and the metrics are there."""
    for family in plugins("scenario").values():
        assert family.paragraph("Provokes"), family.name
        shown = [name.strip() for name in family.paragraph("Shows in").split(",")]
        assert shown
        assert set(shown) <= set(METRICS), family.name
    lines = listing("scenarios")
    assert len(lines) == len(plugins("scenario"))
    assert any("near a singularity" in line and "velocity_peak_ratio" in line for line in lines)
