"""What a run says of itself: exit codes, what is missing, what nothing was asked for."""

from __future__ import annotations

import json
import re
from pathlib import Path
from typing import Any

import pytest
from click.testing import CliRunner
from makers.plugins import law_with
from makers.runs import without_workers

import dikbench
from dikbench.cli import commands
from dikbench.report.sentences.limitations import in_plan, missing
from dikbench.results.reading import load_results

RUN = ("run", "--scenario", "reach[duration=0.1]", "--plant", "ideal", "--traces", "none")


def run(out: Path, *options: str) -> tuple[int, str, str]:
    """Exit code, stdout and stderr of a run."""
    result = CliRunner().invoke(commands, [*RUN, "--jobs", "1", "--out", str(out), *options])
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
    options = (*RUN[:1], "--scenario", "speed-sweep[speed=0.5,laps=1]", *way, "--traces", "none")
    names = ("--formulation", "oracle", "--formulation", "slowed-oracle", "--formulation", "dls")
    with without_workers():
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
