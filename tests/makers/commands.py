"""The command line in this process and in others, and the files that its commands name."""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
from collections.abc import Sequence
from pathlib import Path

from click.testing import CliRunner, Result

from dikbench.cli import commands


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


SHORT = (
    "--formulation", "dls", "--scenario", "reach[duration=0.2]", "--plant", "ideal",
    "--reference", "time",
)  # fmt: skip


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
