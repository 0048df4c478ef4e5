"""Commands that work: with plug-ins of other projects and of files, times, and what is there."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import pandas as pd
import pytest
from makers.commands import SHORT, in_process, run_all
from makers.runs import without_figures, without_workers

from dikbench.report import write


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
