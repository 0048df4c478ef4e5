"""docs/plug-ins.md: every file in it is written, and every command in it runs."""

from __future__ import annotations

import importlib.util
import shlex
from pathlib import Path
from typing import Any

import pytest
from makers.commands import in_process
from makers.few_states import few_states

from dikbench.results.reading import load_results

TEXT = (Path(__file__).parents[3] / "docs" / "plug-ins.md").read_text(encoding="utf-8")

BLOCKS = [block.partition("\n")[::2] for block in TEXT.split("```")[1::2]]
"""Language and text of each block."""

FILES = {
    text.partition("\n")[0].removeprefix("# "): text
    for language, text in BLOCKS
    if language == "python"
}

COMMANDS = [
    line
    for language, text in BLOCKS
    for line in text.splitlines()
    if not language and line.startswith("dikbench ")
]

NEEDS_QPALM = pytest.mark.skipif(
    importlib.util.find_spec("qpalm") is None, reason="qpalm is not installed"
)


def _marked(command: str) -> Any:
    return pytest.param(command, marks=[NEEDS_QPALM] if "solver.py" in command else [])


@pytest.mark.parametrize("command", [*map(_marked, COMMANDS)])
def test_a_documented_command_runs(
    command: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """With the files of the page beside it; no promise is broken, no trial fails."""
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr("dikbench.report.write.write_report", lambda folder: "")
    for name, text in FILES.items():
        (tmp_path / name).write_text(text)
    if "check my-law" in command:
        in_process("new", "formulation", "my-law")
    arguments = shlex.split(command)[1:]
    if arguments[0] == "run":
        arguments += ["--reference", "time", "--jobs", "1", "--out", "out"]
    with few_states(1, 20):
        done = in_process(*arguments)
    assert done.exit_code == 0, done.output
    assert "BROKEN" not in done.output
    if arguments[0] == "run":
        trials = load_results("out").trials
        assert set(trials["status"]) == {"ok"}
        assert (trials["verified_share"].fillna(1.0) == 1.0).all()


@pytest.mark.parametrize("name", [name for name in FILES if f"{name}:" not in " ".join(COMMANDS)])
def test_a_documented_file_without_a_command_keeps_its_contract(name: str, tmp_path: Path) -> None:
    """The ones that the page shows alone."""
    path = tmp_path / name
    path.write_text(FILES[name])
    with few_states(1, 20):
        done = in_process("check", str(path))
    assert done.exit_code == 0, done.output


def test_every_kind_is_documented() -> None:
    """The page has an example of each, but of families, which a guide of its own shows."""
    assert {name.removesuffix(".py") for name in FILES} == {
        "my_law", "my_own_solver", "my_solver", "my_warm_solver", "my_plant", "my_robot",
        "my_metric",
    }  # fmt: skip
    assert len(COMMANDS) >= 12
