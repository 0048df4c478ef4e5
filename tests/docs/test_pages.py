"""Every command of the README and of the site's pages is one that dikbench takes."""

from __future__ import annotations

import contextlib
import importlib.util
import shutil
from pathlib import Path
from typing import Any

import click
import pytest
from makers.commands import in_process
from makers.few_states import few_states
from makers.pages import CHECKOUT, PAGES, commands_of, files_of, mentioned_in, parse
from makers.urdf_arms import write_urdf

from dikbench.study.plan import expand

HELD_ELSEWHERE = {
    CHECKOUT / "docs" / "plug-ins.md",
    CHECKOUT / "docs" / "guides" / "advice.md",
    CHECKOUT / "docs" / "guides" / "many-machines.md",
}
"""Pages whose commands run in a test of their own."""

PARSED = ("replay", "reproduce", "tune")
"""Commands that are only parsed here: they serve, or take hours, and have tests of their own."""

LONG = ("--benchmark", "--format", "--figure", "--instances", "--instance", "ensembles", "table")
"""What a command has that takes seconds; in the normal run it is parsed."""

STUDY = """
description = "a study of one's own"
scenarios = ["reach"]
plants = ["ideal"]
[[cells]]
formulations = ["dls"]
"""

SAID = [
    (page, arguments)
    for page in PAGES
    if page not in HELD_ELSEWHERE
    for arguments in commands_of(page)
]


def _named(page: Path, arguments: list[str]) -> Any:
    marks = [pytest.mark.long] if {*arguments} & {*LONG} else []
    return pytest.param(page, arguments, id=" ".join([page.name, *arguments])[:100], marks=marks)


def _own(page: Path, text: str) -> str:
    """Name a page's files after it: a file is imported once in a process, by its name."""
    for name in files_of(page):
        text = text.replace(name, f"{page.stem}-{name}")
    return text


def _furnish(folder: Path, page: Path) -> None:
    """Put into a folder what a page shows and names: its files, an arm, poses, results."""
    for name, text in files_of(page).items():
        (folder / _own(page, name)).write_text(text)
    arm = Path(write_urdf(folder / "my_arm.urdf", radius=0.05))
    arm.write_text(arm.read_text().replace("to_link5", "j6"))
    shutil.copy(CHECKOUT / "tests" / "data" / "triangle.csv", folder / "poses.csv")
    (folder / "my_study.toml").write_text(STUDY)
    (folder / "names.toml").write_text('[formulations]\n"dls" = "damped"\n')
    (folder / "results").symlink_to(CHECKOUT / "results")
    (folder / "runs").mkdir()
    for name in ("quick", "now", "choice"):
        (folder / "runs" / name).symlink_to(CHECKOUT / "results" / "quick")


@pytest.mark.parametrize(
    ("page", "arguments"), [_named(*each) for each in SAID if each[1][0] not in PARSED]
)
def test_a_command_of_a_page_runs(
    page: Path, arguments: list[str], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """In a folder with what the page shows; of a run the plan is made, with its first scenarios."""
    monkeypatch.chdir(tmp_path)
    _furnish(tmp_path, page)
    planned: list[Any] = []
    if arguments[0] == "run":
        if "peer" in " ".join(arguments) and importlib.util.find_spec("mink") is None:
            pytest.skip("the extra peers is not installed")
        monkeypatch.setattr(
            "dikbench.run.runner.run_study", lambda study, *rest: planned.extend(expand(study))
        )
        monkeypatch.setattr("dikbench.run.runner.never_moved", lambda folder: {})
        monkeypatch.setattr("dikbench.report.write.write_report", lambda folder: "")
    with few_states(1, 20) if arguments[0] == "check" else contextlib.nullcontext():
        done = in_process(*(_own(page, argument) for argument in arguments))
    assert done.exit_code == 0, done.output
    assert "BROKEN" not in done.output
    assert planned or arguments[0] != "run"


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.name)
def test_every_command_of_a_page_is_valid(page: Path) -> None:
    """Each in its blocks has options that there are; one in its sentences may leave names out."""
    for arguments in commands_of(page):
        parse(arguments)
    for arguments in mentioned_in(page):
        with contextlib.suppress(click.MissingParameter):
            parse(arguments)
