"""Runs in lockstep: the rows of runs alone, whatever ends a worker, however they are divided."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from dataclasses import replace
from itertools import pairwise
from pathlib import Path
from typing import Any

import msgspec
import numpy as np
import pandas as pd
import pinocchio as pin
import pytest
from makers.runs import run_here, without_workers

from dikbench import load_results
from dikbench.errors import DikbenchError
from dikbench.plugins.building import make_formulation, make_scenario
from dikbench.plugins.finding import plugins
from dikbench.results.folder import ResultsFolder
from dikbench.results.store import Store
from dikbench.run import blocks, on_this_machine
from dikbench.run.in_workers import RunSettings, run_trials
from dikbench.run.runner import Interrupted
from dikbench.run.trial_row import TrialRow, solve_of
from dikbench.scenario.plant import Ideal
from dikbench.selector import parse_selector
from dikbench.simulation.closed_loop import simulate
from dikbench.study.plan import PlannedTrial, expand
from dikbench.study.selection import Selection, select
from dikbench.study.study import Study, load_study

NEAR_MISSES = (
    "near-miss[robot=panda,dt=0.05,miss=0.01|0.02|0.03,speed=0.3]",
    "near-miss[robot=ur5,dt=0.05,miss=0.03]",
)
OF_SOLVERS = {
    "lied", "claimed_share", "verified_share", "primal_residual_max", "dual_residual_max",
    "gap_max", "optimum_distance_max_rad_s",
}  # fmt: skip
"""What is about the solver's answer and not about the motion."""
NOT_COMPARED = {"wall_time_s", "control_time_s", "described", "asked_alone_steps"}

HOSTILE = '''
import os
from dataclasses import dataclass
import numpy as np
from dikbench.problem import least_norm

@dataclass(frozen=True)
class Hostile:
    """Goes wrong where it is asked for many, for a robot of six joints or for all."""

    how: str = "raise"
    batched = True

    def velocity(self, problem, solve):
        if self.how == "exit" or (self.how == "ur5 exits" and problem.robot.nv == 6):
            os._exit(3)
        if self.how == "raise":
            raise RuntimeError("no")
        if self.how == "sys.exit":
            raise SystemExit(0)
        if self.how == "interrupt":
            raise KeyboardInterrupt
        if self.how == "memory for many" and problem.q.ndim == 2:
            raise MemoryError
        if self.how == "changes the problem":
            problem.relaxed = "x"
        if self.how == "sets errors":
            np.seterr(all="raise")
        if self.how == "underflows":
            np.array([1e-200]) ** 2
        return least_norm(problem.primary.J, problem.primary.V, 1e-6)
'''


def _study(formulations: Sequence[str], scenarios: Sequence[str] = NEAR_MISSES) -> Study:
    selection = Selection(
        formulations=tuple(formulations),
        scenarios=tuple(scenarios),
        plants=("ideal",),
        seeds=(0, 1),
    )
    return select(load_study("smoke"), selection, named=False)


def _rows(study: Study, out: Path, engine: blocks.Engine, jobs: int = 1) -> dict[str, TrialRow]:
    folder = ResultsFolder(out)
    folder.traces.mkdir(parents=True)
    settings = RunSettings(jobs=jobs, engine=engine)
    found = run_trials(expand(study), folder, settings, engine=engine)
    return {p.id: row for some in found for p, row in some}


def _assert_same(made: TrialRow, known: TrialRow, tolerance: float) -> None:
    """Assert that two rows of a trial tell of the same motion."""
    for name in made.keys() | known.keys():
        if name in NOT_COMPARED | OF_SOLVERS:
            continue
        one, other = made.get(name), known.get(name)
        if isinstance(one, float | np.floating) and isinstance(other, float | int | np.floating):
            assert one == pytest.approx(other, rel=tolerance, abs=tolerance, nan_ok=True), name
        else:
            assert one == other, name


def test_rows_are_those_of_runs_alone(tmp_path: Path) -> None:
    """By both engines; who cannot answer many runs alone, inside the same blocks."""
    study = _study(["dls", "pinv[after=clip]", "qp", "lp-alpha", "hqp", "oracle"])
    with without_workers():
        alone = _rows(study, tmp_path / "alone", "alone")
        together = _rows(study, tmp_path / "together", "lockstep")
    assert together.keys() == alone.keys()
    for trial, row in together.items():
        _assert_same(row, alone[trial], 1e-8)
        asked = row["formulation"] in ("hqp", "oracle") or row["status"] == "skipped"
        assert ("asked_alone_steps" in row) != asked
    names = [
        sorted(path.name for path in (tmp_path / e).rglob("*.arrow")) for e in ("alone", "together")
    ]
    assert names[0] == names[1]
    assert len(names[0]) > 40


def test_a_run_is_the_same_with_one_worker_and_with_two(tmp_path: Path) -> None:
    """To the bit, though the blocks are others; what ends a worker costs its own rows only.

    The one worker is this process, without the formulation that would end it.
    """
    (tmp_path / "hostile.py").write_text(HOSTILE)
    hostile = f"{tmp_path}/hostile.py:Hostile"
    harmless, ends = ["dls", "qp", f"{hostile}[how=raise]"], f"{hostile}[how='ur5 exits']"
    both = [msgspec.structs.replace(_study(of), seeds=(0,)) for of in (harmless, [*harmless, ends])]
    with without_workers():
        one = _rows(both[0], tmp_path / "one", "lockstep", jobs=1)
    two = _rows(both[1], tmp_path / "two", "lockstep", jobs=2)
    assert one.keys() == {trial for trial, row in two.items() if "exits" not in row["formulation"]}
    for trial, row in two.items():
        compared = row.keys() - NOT_COMPARED
        assert trial not in one or {name: str(row[name]) for name in compared} == {
            name: str(one[trial][name]) for name in compared
        }
        if "exits" in row["formulation"] and "ur5" in row["scenario"]:
            assert row["status"] == "crashed"
        elif "raise" in row["formulation"]:
            assert row["status"] == "formulation-error"
            assert row["message"].startswith("step 0: RuntimeError: no")
        else:
            assert row["status"] in ("ok", "skipped"), row


HOWS = {
    "sys.exit": ("crashed", "SystemExit"),
    "interrupt": ("crashed", "KeyboardInterrupt"),
    "memory for many": ("ok", ""),
    "changes the problem": ("formulation-error", ""),
    "sets errors": ("ok", ""),
    "underflows": ("ok", ""),
}
"""What formulations do, and how their trials end."""


def test_what_a_formulation_does_changes_no_bit_of_others(tmp_path: Path) -> None:
    """It ends its own trials only, as alone, whatever it raises and wherever."""
    (tmp_path / "hostile.py").write_text(HOSTILE)
    hostile = [f"{tmp_path}/hostile.py:Hostile[how='{how}']" for how in HOWS]
    scenarios = NEAR_MISSES[1:]
    with without_workers():
        apart = _rows(_study(["dls", "qp"], scenarios), tmp_path / "apart", "lockstep")
        beside = _rows(_study(["dls", *hostile, "qp"], scenarios), tmp_path / "beside", "lockstep")
    assert apart.keys() <= beside.keys()
    for trial, row in beside.items():
        if trial in apart:
            compared = row.keys() - NOT_COMPARED
            assert {name: str(row[name]) for name in compared} == {
                name: str(apart[trial][name]) for name in compared
            }
            continue
        status, words = HOWS[row["formulation"].partition("how=")[2].strip("]'")]
        assert row["status"] in (status, "skipped")
        assert words in row["message"]


def test_a_run_that_is_stopped_goes_on_to_the_same_rows(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """What was committed is kept, whole blocks of it, and nothing runs twice."""
    study = msgspec.structs.replace(_study(["dls", "qp"]), timing=None)
    settings = RunSettings(jobs=2, engine="lockstep", traces="none")
    run_here(study, tmp_path / "whole", settings, "a test")
    record = Store.record_trials
    committed: list[int] = []

    def stopped(store: Store, rows: Any, run: int) -> None:
        if len(committed) == 2:
            raise KeyboardInterrupt
        record(store, rows, run)
        committed.append(len(rows))

    monkeypatch.setattr(Store, "record_trials", stopped)
    # Rows of blocks that end together are committed together: one at a time.
    monkeypatch.setattr(on_this_machine, "BLOCKS_HANDED_AHEAD_PER_WORKER", 0.5)
    with pytest.raises(Interrupted, match=r"trials are done and kept"):
        run_here(study, tmp_path / "stopped", settings, "a test")
    done = sum(committed)
    monkeypatch.setattr(Store, "record_trials", record)
    kept = load_results(tmp_path / "stopped").trials
    assert 0 < len(kept) == done
    # Without its engine being named, that of its rows is kept.
    run_here(study, tmp_path / "stopped", RunSettings(jobs=2, traces="none"), "a test")
    found, known = (load_results(tmp_path / each).trials for each in ("stopped", "whole"))
    dropped = ["run", "environment"]
    pd.testing.assert_frame_equal(
        found.drop(columns=dropped), known.drop(columns=dropped), check_exact=True
    )


def test_the_engine_is_chosen_once(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Many of a kind run in lockstep, a few alone; rows of both are not mixed."""
    monkeypatch.setattr(blocks, "LEAST_ROWS", 5)
    few = msgspec.structs.replace(_study(["dls"], NEAR_MISSES[1:]), timing=None)
    many = msgspec.structs.replace(_study(["dls"]), seeds=tuple(range(5)), timing=None)
    laws = [f"dls[damping={damping}]" for damping in (0.1, 0.2, 0.3, 0.4)]
    one_each = msgspec.structs.replace(_study(laws, NEAR_MISSES[1:]), timing=None, seeds=(0, 1))
    assert blocks.engine_of(expand(one_each), "auto", Store(tmp_path / "none.sqlite")) == "alone"
    assert blocks.engine_of(expand(many), "auto", Store(tmp_path / "none.sqlite")) == "lockstep"
    for study, engine in ((few, "alone"), (many, "lockstep")):
        out = tmp_path / engine
        run_here(study, out, RunSettings(jobs=1, traces="none"), "a test")
        results = load_results(out)
        assert results.manifest["engine"] == engine
        assert results.trials["asked_alone_steps"].notna().any() == (engine == "lockstep")
        other: Any = "lockstep" if engine == "alone" else "alone"
        with pytest.raises(DikbenchError, match=rf"engine={engine}; valid: that, or another"):
            run_here(study, out, RunSettings(jobs=1, engine=other), "a test")


def _planned(cells: Sequence[tuple[str, str]]) -> list[PlannedTrial]:
    study = _study(["dls"])
    first = expand(study)[0]
    return [
        PlannedTrial(
            str(number),
            replace(
                first.trial,
                scenario=parse_selector(scenario),
                formulation=parse_selector(formulation),
            ),
        )
        for number, (formulation, scenario) in enumerate(cells)
    ]


@pytest.mark.parametrize("jobs", [1, 2, 16])
def test_blocks_hold_every_trial_once(jobs: int) -> None:
    """All of a scenario in one block; families and robots beside their like; enough for all."""
    cells = [
        (formulation, f"near-miss[robot={robot},miss={miss}]")
        for miss in range(1, 40)
        for robot in ("panda", "ur5")
        for formulation in ("dls", "qp", "pinv")
    ]
    planned = _planned(cells)
    found = blocks.blocks_of(planned, jobs)
    assert sorted(p.id for block in found for p in block) == sorted(p.id for p in planned)
    assert len(found) >= min(78, 2 * jobs)
    for block in found:
        scenarios = {p.trial.scenario for p in block}
        assert len(block) == 3 * len(scenarios)
    changes = [p.trial.scenario.parameters["robot"] for block in found for p in block]
    assert sum(a != b for a, b in pairwise(changes)) == 1


def test_a_block_that_ended_its_worker_becomes_smaller() -> None:
    """By formulation first, then trial by trial."""
    block = _planned([(law, f"reach[speed={k}]") for law in ("dls", "qp") for k in (1, 2, 3)])
    halves = list(blocks.smaller(block))
    assert [[str(p.trial.formulation) for p in half] for half in halves] == [
        ["dls"] * 3, ["qp"] * 3,
    ]  # fmt: skip
    assert [len(single) for single in blocks.smaller(halves[0])] == [1, 1, 1]


SENSITIVE_RAD = 1e-12
"""How far a start is moved to see whether rounding grows by itself."""

ACTIVE_SET = ("none", "daqp")
"""Solvers, and none, that are exact to rounding; the others to their tolerance."""


def _why(row: TrialRow) -> str:
    """Name why a trial alone and one in lockstep may differ; empty where they must not."""
    if not str(row["solver"]).startswith(ACTIVE_SET):
        return "inexact solver"
    scenario = make_scenario(row["scenario"], row["seed"])
    selector, solver = parse_selector(row["formulation"]), parse_selector(row["solver"])
    mode: Any = row["reference"]
    applied = []
    for step in (0.0, SENSITIVE_RAD):
        q0 = pin.integrate(scenario.robot.model, scenario.q0, np.full(scenario.robot.nv, step))
        moved = replace(scenario, q0=q0)
        run = simulate(moved, make_formulation(selector), solve_of(selector, solver), Ideal(), mode)
        applied.append(run.trace.applied)
    steps = min(map(len, applied))
    grown = np.abs(applied[0][:steps] - applied[1][:steps]).max() > 1e-8
    return "rounding grows in the trial alone, too" if grown else ""


def _one_of_each_family() -> Study:
    selection = Selection(
        formulations=tuple(plugins("formulation")),
        scenarios=tuple(name for name in plugins("scenario") if name != "csv"),
        plants=("ideal",),
        references=("time", "path"),
        seeds=(0,),
    )
    return select(load_study("smoke"), selection, named=False)


@pytest.mark.long
@pytest.mark.parametrize("study", ["one of each family", "quick"])
def test_engines_agree_or_it_is_said_why(tmp_path: Path, study: str) -> None:
    """Every physical column to 1e-8; what differs does for a reason with a name, and is counted."""
    chosen = load_study(study) if study == "quick" else _one_of_each_family()
    alone = _rows(chosen, tmp_path / "alone", "alone", jobs=2)
    together = _rows(chosen, tmp_path / "together", "lockstep", jobs=2)
    reasons: Counter[str] = Counter()
    for trial, row in together.items():
        try:
            _assert_same(row, alone[trial], 1e-8)
        except AssertionError:
            why = _why(alone[trial])
            assert why, row
            reasons[why] += 1
    print(f"{len(together)} trials; different: {dict(reasons)}")
    assert reasons["rounding grows in the trial alone, too"] <= len(together) // 20
