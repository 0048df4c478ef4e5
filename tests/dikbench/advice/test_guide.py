"""The guide: its commands are commands, and run."""

from __future__ import annotations

import re
import shlex
from pathlib import Path

import click
import pandas as pd
import pytest
from makers.commands import in_process

from dikbench.cli import commands
from dikbench.robots.example_robot_data import data_file

GUIDE = Path(__file__).parents[3] / "docs" / "guides" / "advice.md"

COMMANDS = [
    shlex.split(line)[1:]
    for block in re.findall(r"```bash\n(.*?)```", GUIDE.read_text(encoding="utf-8"), re.S)
    for line in block.splitlines()
]

POSES = """t,x,y,z,qx,qy,qz,qw
0,0.45,0.1,0.4,1,0,0,0
2,0.45,-0.1,0.4,1,0,0,0
4,0.35,-0.1,0.5,1,0,0,0
"""

CELL = """[[sphere]]
centre = [0.4, 0.9, 0.5]
radius = 0.1
"""


@pytest.mark.parametrize("command", COMMANDS, ids=" ".join)
def test_each_command_of_the_guide_is_understood(command: list[str]) -> None:
    """Its options exist and take what they are given."""
    name, *options = command
    found = commands.get_command(click.Context(commands), name)
    assert found is not None
    found.make_context(name, options)


def test_the_guide_has_both_commands() -> None:
    """So that the test above tests something."""
    assert {command[0] for command in COMMANDS} == {"advise", "worst"}


@pytest.mark.long
@pytest.mark.parametrize("command", COMMANDS, ids=" ".join)
def test_each_command_of_the_guide_runs(
    command: list[str], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """And leaves what it says."""
    monkeypatch.chdir(tmp_path)
    urdf = Path(data_file("ur_description/urdf/ur5_robot.urdf")).read_text(encoding="utf-8")
    meshes = f"{Path(data_file('.')).absolute()}/"
    Path("my_arm.urdf").write_text(urdf.replace("package://example-robot-data/robots/", meshes))
    Path("poses.csv").write_text(POSES)
    Path("cell.toml").write_text(CELL)
    answer = in_process(*command)
    assert answer.exit_code == 0, answer.output
    made = "advice.html" if command[0] == "advise" else "search.csv"
    assert list(Path("runs").rglob(made))
    if command[0] == "worst":
        assert "the same to the bit" in answer.output


STRAW = Path(__file__).parents[3] / "dikbench" / "testing" / "straw.py"


@pytest.mark.long
@pytest.mark.parametrize("seed", ["0", "1"])
def test_straw_laws_are_never_recommended(seed: str, tmp_path: Path) -> None:
    """Not on a UR5, for no need, whatever the seed; and the budget is kept."""
    names = ("Idle", "Creeper", "Reckless", "Jittery")
    options = [part for name in names for part in ("--formulation", f"{STRAW}:{name}")]
    answer = in_process(
        "advise", "ur5", *options, "--seed", seed, "--budget", "90s", "--out", str(tmp_path)
    )
    assert answer.exit_code == 0, answer.output
    told = answer.output.partition("What is recommended")[2].partition("\n\n")[0]
    for line in told.strip().splitlines():
        assert "straw.py" not in line, line
        assert " of " in line
    trials = pd.read_csv(tmp_path / "advice.csv", low_memory=False)
    ran = trials.groupby("formulation")["seed"].nunique()
    assert all(ran[name] == ran.max() for name in ran.index if "straw.py" in name)
