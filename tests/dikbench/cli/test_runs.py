"""What a run says of itself: exit codes, what is missing, what nothing was asked for."""

from __future__ import annotations

import json
import re
import shutil
from pathlib import Path
from typing import Any

import pytest
from click.testing import CliRunner
from makers.plugins import law_with
from makers.runs import without_figures, without_workers

import dikbench
from dikbench.cli import commands
from dikbench.invariants import with_straw_laws
from dikbench.report.sentences.limitations import in_plan, missing
from dikbench.results.reading import load_results
from dikbench.study.study import load_study

RUN = ("run", "--scenario", "reach[duration=0.1]", "--plant", "ideal", "--traces", "none")


def run(out: Path, *options: str) -> tuple[int, str, str]:
    """Exit code, stdout and stderr of a run in this process, whose report has no figures."""
    with without_workers(), without_figures():
        result = CliRunner().invoke(commands, [*RUN, "--out", str(out), *options])
    return result.exit_code, result.stdout, result.stderr


def test_a_formulation_that_never_moved_is_exit_code_3(tmp_path: Path) -> None:
    """All of its cells were skipped: the run says which and why, after the report."""
    mixed = ("--formulation", "lp-alpha", "--formulation", "dls", "--solver", "proxqp")
    code, out, err = run(tmp_path / "out", *mixed)
    assert code == 3
    assert "report.html" in out
    (line,) = (line for line in err.splitlines() if "took a step" in line)
    assert line.startswith("no trial of lp-alpha took a step: 2 skipped: proxqp cannot")
    assert run(tmp_path / "out", "--formulation", "dls")[0] == 0


def test_a_formulation_that_fails_at_once_is_exit_code_3(tmp_path: Path) -> None:
    """It fails before the first step of every trial; one that fails later has moved."""
    never = law_with(tmp_path, "gain: float = 1.0")
    code, _, err = run(tmp_path / "out", "--formulation", never)
    assert code == 3
    assert "took a step: 1 wrong-shape: step 0" in err


@pytest.mark.parametrize("way", [("--plant", "saturating"), ("--reference", "path")])
def test_the_oracle_is_not_missing_for_ever(tmp_path: Path, way: tuple[str, str]) -> None:
    """It ran as it can; nothing of the plan is missing and no row is of an earlier run."""
    options = (
        *RUN[:1],
        "--scenario",
        "speed-sweep[speed=0.5,laps=1,dt=0.02]",
        *way,
        "--traces",
        "none",
    )
    names = ("--formulation", "oracle", "--formulation", "slowed-oracle", "--formulation", "dls")
    with without_workers(), without_figures():
        result = CliRunner().invoke(
            commands, [*options, *names, "--jobs", "1", "--out", str(tmp_path / "out")]
        )
    assert result.exit_code == 0, result.output
    results = load_results(tmp_path / "out")
    assert len(results.trials) == results.manifest["trials"] > 2
    assert in_plan(results.trials, results.manifest["study"]).all()
    assert missing(results.trials, results.manifest) == 0
    assert not re.search(r"\d missing|earlier run", result.stdout)


def test_empty_axes_are_the_study_s_own(tmp_path: Path) -> None:
    """From Python an empty list replaces nothing."""
    study = tmp_path / "mine.toml"
    study.write_text(
        'description = "mine"\nscenarios = ["reach[duration=0.1]"]\nplants = ["ideal"]\n'
        'seeds = [3]\n[[cells]]\nformulations = ["dls"]\n'
    )
    chosen: dict[str, Any] = {"formulations": [], "seeds": [], "scenarios": ()}
    with without_workers():
        results = dikbench.run_study(study, **chosen, out=tmp_path / "out", jobs=1, report=False)
    assert results.trials[["formulation", "seed"]].to_numpy().tolist() == [["dls", 3]]
    assert json.loads((tmp_path / "out" / "manifest.json").read_text())["trials"] == 1


STUDY = """
description = "mine"
scenarios = ["reach[duration=0.1]"]
plants = ["ideal"]
[[cells]]
formulations = ["dls"]
"""


def test_a_folder_holds_one_study(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Another study, its times and a check with straw laws are refused in one line.

    The same study goes on in it, and what is selected by options may be added, but not to what was
    run with straw laws: its tables would be taken for those of a study. Nor is a study added to
    what was selected, unless its own rows are there.
    """
    monkeypatch.chdir(tmp_path)
    for name in ("mine", "check-mine"):
        Path(f"{name}.toml").write_text(STUDY)
    Path("other.toml").write_text(STUDY + '[timing]\nreference = "dls"\n')

    def ran(*study: str, **axes: str) -> int:
        with without_workers():
            done = dikbench.run_study(*study, **axes, out="out", traces="none", report=False)  # type: ignore[arg-type]
        return len(done.trials)

    def refused(there: str, *arguments: str) -> None:
        result = CliRunner().invoke(commands, [*arguments, "--out", "out"])
        (line,) = result.stderr.splitlines()
        assert result.exit_code == 2, line
        assert f"out holds the results of study {there!r}" in line
        assert "valid: another folder with --out" in line

    assert ran("mine.toml") == 1
    before = Path("out/trials.csv").read_bytes()
    refused("mine", "run", "other.toml")
    refused("mine", "time", "other.toml")
    refused("mine", "check", "--benchmark", "mine.toml")
    refused("mine", "check", "--benchmark", "other.toml")
    assert Path("out/trials.csv").read_bytes() == before
    assert ran("mine.toml") == 1
    assert ran(formulations="pinv", scenarios="reach[duration=0.1]", plants="ideal") == 3
    assert ran("mine.toml") == 3
    refused("mine", "run", "other.toml")
    shutil.rmtree("out")
    ran(formulations="pinv", scenarios="reach[duration=0.1]", plants="ideal")
    refused("selection", "run", "mine.toml")
    ran(formulations="dls", scenarios="reach[duration=0.1]", plants="ideal")
    shutil.rmtree("out")
    ran("check-mine.toml")  # as the check names what it runs
    refused("check-mine", "run", "mine.toml")
    refused("check-mine", *RUN, "--formulation", "pinv")
    assert with_straw_laws(load_study("mine.toml")).name == "check-mine"
