"""Tuning from end to end, on one scenario, in this process."""

from __future__ import annotations

import re
import shlex
import shutil
import sqlite3
from pathlib import Path
from typing import Any

import msgspec
import pandas as pd
import pytest
from click.testing import CliRunner
from makers.runs import without_workers

from dikbench.cli import commands
from dikbench.errors import DikbenchError
from dikbench.plugins.building import in_declared_order, make_formulation
from dikbench.plugins.tuned import FILE, ranges_of, read_tuned
from dikbench.run.in_workers import RunSettings
from dikbench.run.runner import Interrupted
from dikbench.selector import parse_selector
from dikbench.study.study import Cells, Study
from dikbench.tuning import tuning
from dikbench.tuning.drawing import draw_sensitivity
from dikbench.tuning.tables import gain_in_words, in_words, summary, write_tables

LAZY = '''
from dataclasses import dataclass
from typing import Annotated
import numpy as np
from dikbench.parameters import Drawn, Parameters, Range

@dataclass(frozen=True)
class Lazy(Parameters):
    """Do a share of the task, which is best at one."""

    share: Annotated[float, Range(0.0, 1.0), Drawn(0.0, 1.0)] = 0.5

    def velocity(self, problem, solve):
        return self.share * np.linalg.pinv(problem.primary.J) @ problem.primary.V
'''

STUDY = Study(
    "One circle",
    (Cells(("dls",)),),
    ("speed-sweep[robot=ur5,speed=0.3,radius=0.05]",),
    plants=("ideal",),
    references=("time", "path"),
    seeds=(1,),
    split="train",
    name="one",
)


@pytest.fixture(scope="module")
def tuned(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, list[tuning.Tuning]]:
    """Tune a law that does a share of its task; return its file and what came of it."""
    folder = tmp_path_factory.mktemp("tuned")
    file = folder / "lazy.py"
    file.write_text(LAZY)
    law, settings = parse_selector(f"{file}:Lazy"), RunSettings(1, traces="none")
    test = msgspec.structs.replace(STUDY, split="test", seeds=(100,), name="test")
    with without_workers(), pytest.MonkeyPatch.context() as patch:
        found = list(tuning.tune([law], STUDY, 4, 0, folder / "out", settings, "tune"))
        patch.setattr(tuning, "load_study", lambda name: test)
        found = tuning.report_on_test(found, folder / "out", settings, "tune")
    return file, found


def test_the_best_share_is_the_largest(tuned: tuple[Path, list[tuning.Tuning]]) -> None:
    """A feedback that does nearly all of its task is nearest to the path."""
    _, (found,) = tuned
    shares = [float(each.parameters["share"]) for each in found.scores.candidates]
    assert found.entry.parameters == {"share": max(shares)}
    assert found.name == "lazy.py:Lazy"
    assert found.entry.success >= found.entry.default_success
    assert len(found.entry.source) == 16


def test_what_is_frozen_is_selected(tuned: tuple[Path, list[tuning.Tuning]]) -> None:
    """`file.py:Lazy[tuned]` stands for the parameters; other entries of the file are kept."""
    file, found = tuned
    beside = file.with_name(FILE)
    other = msgspec.structs.replace(found[0].entry, parameters={"share": 0.25})
    tuning.write_tuned(beside, {"Other": other})
    assert tuning.freeze(found) == [beside]
    assert read_tuned(beside) == {"Other": other, "lazy.py:Lazy": found[0].entry}
    share = found[0].entry.parameters["share"]
    law = f"{file}:Lazy[tuned]"
    assert f"share={share}" in repr(make_formulation(law))
    assert in_declared_order("formulation", law).parameters == {"share": f"{share:.4g}"}


def test_a_formulation_that_fails_everywhere_is_named(tmp_path: Path) -> None:
    """The error gives the reason that its trials give."""
    file = tmp_path / "broken.py"
    file.write_text(LAZY.replace("problem.primary.V", "problem.nothing"))
    law, settings = parse_selector(f"{file}:Lazy"), RunSettings(1, traces="none")
    with without_workers(), pytest.raises(DikbenchError, match=r"no trial counts: .*'nothing'"):
        list(tuning.tune([law], STUDY, 2, 0, tmp_path / "out", settings, "tune"))


def test_rows_of_an_earlier_plan_do_not_count(tmp_path: Path) -> None:
    """A study that has lost a scenario, in the folder of its runs, is judged as in a new one."""
    file = tmp_path / "lazy.py"
    file.write_text(LAZY)
    law, settings = parse_selector(f"{file}:Lazy"), RunSettings(1, traces="none")
    two = msgspec.structs.replace(STUDY, scenarios=(*STUDY.scenarios, "reach"))
    found = []
    with without_workers():
        for study, out in ((two, "a"), (STUDY, "a"), (STUDY, "b")):
            (each,) = tuning.tune([law], study, 2, 0, tmp_path / out, settings, "tune")
            found.append(each)
    assert [each.scores.cases for each in found] == [2, 1, 1]
    assert list(found[1].scores.success) == list(found[2].scores.success)


def test_parameters_of_another_source_are_said(tuned: tuple[Path, list[tuning.Tuning]]) -> None:
    """What was tuned before an edit is still selected, with a warning."""
    file, found = tuned
    other = msgspec.structs.replace(found[0].entry, source="0" * 16)
    tuning.write_tuned(file.with_name(FILE), {"lazy.py:Lazy": other})
    with pytest.warns(UserWarning, match=r"lazy.py:Lazy has another source than when it was tuned"):
        make_formulation(f"{file}:Lazy[tuned]")


def test_tables_and_picture_say_it(tuned: tuple[Path, list[tuning.Tuning]], tmp_path: Path) -> None:
    """A row per formulation and one per candidate; one panel; a line each."""
    _, found = tuned
    write_tables(found, tmp_path)
    tried = pd.read_csv(tmp_path / "candidates.csv")
    assert len(tried) == 1 + 4
    assert list(tried["candidate"][tried["tuned"]]) == [str(found[0].scores.best)]
    row = summary(found).iloc[0]
    assert row["test_gain"] == pytest.approx(row["test_tuned"] - row["test_default"], abs=0.02)
    assert "4 candidates" in in_words(found[0])
    assert "cases of the test split" in gain_in_words(found[0])
    assert draw_sensitivity(found, tmp_path).read_text().count("share") == 1


@pytest.mark.parametrize(
    ("arguments", "told"),
    [
        (["pinv"], "error: formulation 'pinv' has no parameter to tune; valid: "),
        (["dls", "--study", "test"], "error: study test: split = 'test'; valid for tuning: "),
        (["dls", "--study", "quick"], "error: study quick: split = ''; valid for tuning: "),
        (["dls[damping=0.1]"], "error: formulation 'dls[damping=0.1]' has no parameter to tune"),
        (["nobody"], "error: unknown formulation 'nobody'"),
    ],
)
def test_what_cannot_be_tuned_is_one_line(arguments: list[str], told: str, tmp_path: Path) -> None:
    """The error says what would be valid, and nothing runs."""
    result = CliRunner().invoke(commands, ["tune", *arguments, "--out", str(tmp_path / "out")])
    assert result.exit_code == 2
    assert result.output.startswith(told)
    assert result.output.count("\n") == 1
    assert not (tmp_path / "out").exists()


@pytest.mark.parametrize(
    ("law", "told"),
    [
        ("neo[tuned]", "`dikbench tune --freeze neo` adds it"),
        ("neo[tuned,damper_gain=1]", "`dikbench tune --freeze 'neo[damper_gain=1]'` adds it"),
        ("dls[damping=0.1,tuned]", "it gives what tuning finds (damping); valid: dls[damping=0.1]"),
        ("pinv[tuned,after=clip]", "it has no parameter to tune; valid: pinv[after=clip]"),
        ("dls[tuned,dampng=1]", "did you mean 'damping'?"),
    ],
)
def test_the_hint_of_what_is_not_tuned_is_a_command_that_works(
    law: str, told: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    """In a shell, or there is none."""
    monkeypatch.setattr("dikbench.plugins.tuned.read_tuned", lambda file: {})
    with pytest.raises(DikbenchError) as caught:
        make_formulation(law)
    assert told in str(caught.value)
    commanded = re.findall("`(dikbench tune .*)`", str(caught.value))
    assert [bool(ranges_of(parse_selector(shlex.split(each)[-1]))) for each in commanded] == [
        True
    ] * len(commanded)


def test_a_trial_that_a_busy_machine_stopped_is_run_again_on_request(
    tuned: tuple[Path, list[tuning.Tuning]], tmp_path: Path
) -> None:
    """`--rerun failed`, as of `dikbench run`; else it stays as it is."""
    file, (found,) = tuned
    law, out = parse_selector(f"{file}:Lazy"), tmp_path / "out"
    shutil.copytree(file.with_name("out"), out)
    database = out / found.name / "results.sqlite"
    with sqlite3.connect(database) as store:
        store.execute("UPDATE trials SET status = 'timeout' WHERE formulation NOT LIKE '%[%'")
    left = []
    for rerun in ("", "failed"):
        settings = RunSettings(1, traces="none", rerun=rerun)
        with without_workers():
            (again,) = tuning.tune([law], STUDY, 4, 0, out, settings, "tune")
        left.append(float(again.scores.success[0]))
    assert left == [0.0, found.scores.success[0]]
    assert found.scores.success[0] > 0


@pytest.mark.parametrize("given", [[], ["--rerun", "failed"]])
def test_rerun_reaches_the_runs(
    given: list[str], monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    """As it is given on the command line."""
    asked: list[RunSettings] = []

    def stopped(*arguments: Any) -> None:
        asked.append(arguments[5])
        raise Interrupted("")

    monkeypatch.setattr(tuning, "tune", stopped)
    CliRunner().invoke(commands, ["tune", "dls", "--out", str(tmp_path), *given])
    assert [each.rerun for each in asked] == [given[-1] if given else ""]


def test_what_is_not_tuned_is_said(tmp_path: Path) -> None:
    """The error names the file, what it holds, and the command that adds it."""
    file = tmp_path / "lazy.py"
    file.write_text(LAZY)
    with pytest.raises(DikbenchError, match=r"'lazy.py:Lazy' is not tuned in .*; valid: none"):
        make_formulation(f"{file}:Lazy[tuned]")
    file.with_name(FILE).write_text("[Lazy]\nparameters = 3\n")
    with pytest.raises(DikbenchError, match=r"tuned.toml: not tuned parameters: "):
        make_formulation(f"{file}:Lazy[tuned]")
    file.with_name(FILE).write_text("[[[")
    with pytest.raises(DikbenchError, match=r"tuned.toml: not tuned parameters: "):
        make_formulation(f"{file}:Lazy[tuned]")
