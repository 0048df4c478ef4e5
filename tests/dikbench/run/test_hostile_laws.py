"""Laws that do what they must not: each ends as a row, and the run goes on."""

from __future__ import annotations

import pickle
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import pandas as pd
import pytest
from makers.runs import UNEQUAL, briefly_timed, without_figures, without_workers
from makers.shared import made_once

from dikbench.report.write import write_report
from dikbench.results.folder import ResultsFolder
from dikbench.run.in_workers import RunSettings, run_trials
from dikbench.run.runner import run_study
from dikbench.study.plan import expand
from dikbench.study.selection import Selection, select
from dikbench.study.study import load_study

HOSTILE = '''
import os, random, signal, sys, time
from dataclasses import dataclass
import numpy as np

forked = []

@dataclass(frozen=True)
class Hostile:
    """Does what a formulation must not."""

    how: str = "raise"

    def velocity(self, problem, solve):
        if self.how == "raise":
            raise RuntimeError("first line\\nsecond line")
        if self.how == "exit":
            os._exit(3)
        if self.how == "exit orderly":
            os._exit(0)
        if self.how == "sys.exit":
            sys.exit(0)
        if self.how == "memory":
            hoard = [np.empty(2**24) for _ in range(4000)]
        while self.how == "spin":
            pass
        if self.how == "sleep":
            time.sleep(3600)
        if self.how == "write to J":
            problem.primary.J[0, 0] = 1.0
        if self.how == "write to q":
            problem.q[0] = 1.0
        if self.how == "write to limits":
            problem.limits.joint.velocity.upper[:] = 100.0
        if self.how == "crash":
            os.kill(os.getpid(), signal.SIGSEGV)
        if self.how == "nan":
            return np.full(problem.robot.nv, np.nan)
        if self.how == "shape":
            return np.zeros(problem.robot.nv + 1)
        if self.how == "print":
            print("x" * 10**6)
            os.write(2, b"y" * 10**6)
        if self.how in ("fork", "forked copy") and not forked:
            forked.append(True)  # once: a copy that forks in every step would be a bomb
            if os.fork() == 0 and self.how == "fork":
                time.sleep(600)
        if self.how == "chdir":
            os.chdir("/")
        if self.how == "numpy state":
            np.seterr(all="raise")
            np.random.seed(1)
            random.seed(1)
        if self.how != "diverge":
            return np.zeros(problem.robot.nv)
        return 1e9 * np.ones(problem.robot.nv)
'''


ENDS = {
    "raise": ("formulation-error", "step 0: RuntimeError: first line"),
    "exit": ("crashed", "exit code"),
    "exit orderly": ("crashed", "exit code"),
    "sys.exit": ("crashed", "asked the process to end: SystemExit"),
    "memory": ("out-of-memory", "step 0"),
    "spin": ("timeout", "not finished after 6 s"),
    "sleep": ("timeout", "not finished after 6 s"),
    "write to J": ("formulation-error", "step 0: ValueError"),
    "write to q": ("formulation-error", "step 0: ValueError"),
    "write to limits": ("formulation-error", "step 0: ValueError"),
    "crash": ("crashed", "exit code"),
    "nan": ("not-finite", "step 0"),
    "shape": ("wrong-shape", "step 0: expected (7,), got (8,)"),
    "diverge": ("diverged", "step 0"),
}
"""How a trial ends whose formulation does what it must not, by what it does."""


def write_hostile(folder: Path) -> str:
    """Write the hostile formulation, and return its selector's name."""
    path = folder / "hostile.py"
    path.write_text(HOSTILE)
    return f"{path}:Hostile"


def pairs_of(name: str, hows: Sequence[str]) -> dict[str, tuple[str, str]]:
    """For each thing to do the hostile formulation that does it, and a `dls` of its own."""
    return {
        how: (f"{name}[how={how}]", f"dls[damping={0.05 + 1e-4 * number:g}]")
        for number, how in enumerate(hows)
    }


def selection_of(pairs: Mapping[str, tuple[str, str]], scenario: str = "reach") -> Selection:
    """Both of each pair, one after the other, on the ideal plant."""
    formulations = tuple(one for pair in pairs.values() for one in pair)
    return Selection(formulations=formulations, scenarios=(scenario,), plants=("ideal",))


def rows_of(out: Path, selection: Selection, settings: RunSettings) -> dict[str, dict[str, Any]]:
    """The rows of a run, by formulation."""
    planned = expand(select(load_study("smoke"), selection, named=False))
    folder = ResultsFolder(out)
    folder.traces.mkdir(parents=True)
    found = run_trials(planned, folder, settings)
    return {str(p.trial.formulation): row for some in found for p, row in some}


ENDLESS = ("spin", "sleep")


LIMIT_S = 6.0
"""Of time, for those that never end: a slow machine must not reach it otherwise."""


Pairs = dict[str, tuple[dict[str, Any], dict[str, Any]]]
"""The row of each hostile formulation, and that of `dls`, which was run after it."""


@pytest.fixture(scope="module")
def hung(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The results of a run, with its report, in which laws never end."""
    return made_once(tmp_path_factory, "hung", _run_hung)


def _run_hung(folder: Path) -> None:
    pairs = pairs_of(write_hostile(folder), ENDLESS)
    run_study(
        briefly_timed(select(load_study("smoke"), selection_of(pairs), named=False)),
        folder / "out",
        RunSettings(jobs=2, trial_timeout=LIMIT_S),
        "a test",
    )
    with without_figures():
        write_report(folder / "out")


@pytest.fixture(scope="module")
def pairs(tmp_path_factory: pytest.TempPathFactory, hung: Path) -> Pairs:
    """Those of two runs: one with a short limit of time, and one without."""
    rows = pd.read_csv(hung / "out" / "trials.csv")
    rows = rows[rows["reference"] == "time"].set_index("formulation", drop=False)

    def row(formulation: str) -> dict[str, Any]:
        return {str(name): value for name, value in rows.loc[formulation].items()}

    folder = made_once(tmp_path_factory, "hostile", _run_hostile)
    found: Pairs = pickle.loads((folder / "pairs").read_bytes())
    for how, (bad, good) in pairs_of(str(hung / "hostile.py:Hostile"), ENDLESS).items():
        found[how] = row(bad), row(good)
    return found


def _run_hostile(folder: Path) -> None:
    """Run each other hostile formulation, and `dls` after it; keep the rows."""
    pairs = pairs_of(write_hostile(folder), sorted(ENDS.keys() - set(ENDLESS)))
    settings = RunSettings(jobs=1, trial_timeout=120.0, trial_memory=2000)
    rows = rows_of(folder / "out", selection_of(pairs), settings)
    found = {how: (rows[bad], rows[good]) for how, (bad, good) in pairs.items()}
    (folder / "pairs").write_bytes(pickle.dumps(found))


@pytest.mark.parametrize("how", ENDS)
def test_a_hostile_law_ends_as_a_row_and_the_run_goes_on(pairs: Pairs, how: str) -> None:
    """Whatever a law does, its trial is a row with its status and the others are untouched."""
    bad, good = pairs[how]
    status, message = ENDS[how]
    assert bad["status"] == status
    assert message in bad["message"]
    assert good["status"] == "ok"
    assert good["position_error_final_m"] < 0.01


SHORT = "reach[duration=0.2]"


PATIENT = RunSettings(jobs=1, trial_timeout=120.0)


ODDITIES = ("print", "fork", "forked copy", "chdir", "numpy state")


def test_a_harmless_oddity_of_a_law_changes_nothing(tmp_path: Path) -> None:
    """It ends as `ok`, and the row after it, in the same process, is that of a run without it."""
    pairs = pairs_of(write_hostile(tmp_path), ODDITIES)
    rows = rows_of(tmp_path / "out", selection_of(pairs, SHORT), PATIENT)
    after = [good for _, good in pairs.values()]
    selection = Selection(formulations=tuple(after), scenarios=(SHORT,), plants=("ideal",))
    with without_workers():
        alone = rows_of(tmp_path / "alone", selection, PATIENT)
    for how, (odd, _) in pairs.items():
        assert rows[odd]["status"] == "ok", how
    one, other = (
        pd.DataFrame([found[name] for name in after]).drop(columns=UNEQUAL)
        for found in (rows, alone)
    )
    pd.testing.assert_frame_equal(one, other, check_exact=True)


def test_a_law_that_hangs_is_not_timed_and_the_others_are(hung: Path) -> None:
    """The run ends with its report: the timing pass has no limit for a single call."""
    timed = set(pd.read_csv(hung / "out" / "timing.csv")["formulation"])
    assert timed == {good for _, good in pairs_of("", ENDLESS).values()}
    assert f"not finished after {LIMIT_S:g} s" in (hung / "out" / "report.html").read_text()
