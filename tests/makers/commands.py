"""The command line in this process and in others, and the files that its commands name."""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
import traceback
from collections.abc import Sequence
from contextlib import redirect_stderr, redirect_stdout
from pathlib import Path

import pytest
from click.testing import CliRunner, Result

from dikbench.cli import commands, main


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


def hear_ctrl_c() -> None:
    """Undo in a new process that SIGINT is ignored: a shell's in the background hand that down."""
    signal.signal(signal.SIGINT, signal.default_int_handler)


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


def one_after_the_other(commands: Sequence[Sequence[str]]) -> None:
    """Run commands as `dikbench` does, each in a folder of its own in the current one.

    What libraries of C write is caught as well. `dikbench run` sets a handler of SIGTERM.
    """
    streams, folder, given = (os.dup(1), os.dup(2)), Path.cwd(), sys.argv
    handler = signal.getsignal(signal.SIGTERM)
    try:
        for number, arguments in enumerate(commands):
            os.chdir(folder / str(number) / "cwd")
            sys.argv, code = ["dikbench", *arguments], None
            with Path("../stdout").open("w") as out, Path("../stderr").open("w") as err:
                os.dup2(out.fileno(), 1)
                os.dup2(err.fileno(), 2)
                with redirect_stdout(out), redirect_stderr(err):
                    try:
                        main()
                    except SystemExit as left:
                        code = left.code
                    except BaseException:
                        traceback.print_exc()
            Path("../code").write_text(json.dumps(code))
    finally:
        for stream, kept in enumerate(streams, start=1):
            os.dup2(kept, stream)
            os.close(kept)
        os.chdir(folder)
        sys.argv = given
        signal.signal(signal.SIGTERM, handler)


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
    """Run commands; of each a folder with `stdout`, `stderr`, `code`, and `cwd`, where it ran.

    They run in this process, where all is imported already, or in one of their own that finds
    packages at a path and makes reports without figures.
    """
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
    if path is None:
        with pytest.MonkeyPatch.context() as patch:
            patch.chdir(folder)
            one_after_the_other(commands)
        return folders
    code = (
        "import json, sys; from makers.commands import one_after_the_other as run\n"
        "from makers.runs import without_figures\n"
        "with without_figures(): run(json.loads(sys.argv[1]))"
    )
    command = [sys.executable, "-c", code, json.dumps(commands)]
    found = os.pathsep.join([str(path), str(Path(__file__).parents[1])])
    environment = {**os.environ, "PYTHONPATH": found}
    subprocess.run(command, cwd=folder, env=environment, check=True, timeout=600)
    return folders
