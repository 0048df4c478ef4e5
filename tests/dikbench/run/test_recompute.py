"""Metrics anew from stored traces: the same ones, or those that somebody spoilt, and no others."""

from __future__ import annotations

import io
import json
import shutil
import sqlite3
from contextlib import redirect_stderr
from dataclasses import dataclass
from pathlib import Path

import pandas as pd
import pytest
from makers.runs import run_here, without_workers
from makers.shared import made_once

from dikbench.errors import DikbenchError
from dikbench.metrics import METRICS
from dikbench.results.folder import ResultsFolder
from dikbench.results.reading import load_results
from dikbench.run.in_workers import RunSettings
from dikbench.run.recompute import Recomputed, recompute_results
from dikbench.run.runner import status_of
from dikbench.study.study import Cells, Study

STUDY = Study(
    description="with a solver and without, clocks and paths, noise, laps, a skipped cell",
    cells=(Cells(("dls", "oracle")), Cells(("qp",), ("daqp[interface=warm]",))),
    scenarios=("reach[duration=0.2]", "speed-sweep[laps=1,speed=2]"),
    plants=("ideal", "saturating[noise=1e-4,delay=2]"),
    references=("time", "path"),
    name="short",
)


@pytest.fixture(scope="module")
def fresh(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The results of the study, as the run left them."""
    return made_once(
        tmp_path_factory,
        "fresh",
        lambda folder: run_here(STUDY, folder, RunSettings(jobs=2), "a test"),
    )


def recompute_here(folder: Path, jobs: int, command: str) -> Recomputed:
    """Recompute as `recompute_results` does, without workers."""
    with without_workers():
        return recompute_results(folder, jobs, command)


def copied(folder: Path, target: Path) -> Path:
    """Results to be harmed."""
    return Path(shutil.copytree(folder, target))


def moved(folder: Path) -> pd.DataFrame:
    """The trials that made steps."""
    trials = load_results(folder).trials
    return trials[trials["steps"] > 0]


def changed(folder: Path, *statements: str) -> None:
    """Change the store behind everybody's back."""
    with sqlite3.connect(folder / "results.sqlite") as database:
        for statement in statements:
            database.execute(statement)


def test_a_fresh_run_is_recomputed_to_the_same_bits(fresh: Path, tmp_path: Path) -> None:
    """Every exported table, whatever the plant and the reference; the manifest knows of it."""
    copy = copied(fresh, tmp_path / "copy")
    before = {name: (copy / name).read_bytes() for name in ("trials.csv", "timing.csv")}
    stored = load_results(copy).trials
    done = recompute_here(copy, 1, "dikbench recompute")
    assert str(done) == f"{len(moved(copy))} trials recomputed"
    assert {name: (copy / name).read_bytes() for name in before} == before
    pd.testing.assert_frame_equal(load_results(copy).trials, stored, check_exact=True)
    noted = json.loads((copy / "manifest.json").read_text())
    assert noted["command"] == "a test"
    assert noted["recomputed"]["command"] == "dikbench recompute"
    assert sum(status_of(copy).values()) == noted["trials"]


@dataclass(frozen=True)
class Harmed:
    """Results that were harmed in every way and recomputed once.

    Attributes:
        folder: their folder.
        done: what the command said.
        errors: what it printed.
        ids: of the trials that moved.
        bad: of those whose trace was cut, emptied, or swapped for another one.
        gone: of the one whose trace was removed.
        other: of the one whose formulation is said to have been another one.
    """

    folder: Path
    done: Recomputed
    errors: str
    ids: list[str]
    bad: list[str]
    gone: str
    other: str


@pytest.fixture(scope="module")
def harmed(fresh: Path, tmp_path_factory: pytest.TempPathFactory) -> Harmed:
    """Every metric overwritten with -1, two columns removed, traces harmed."""
    copy = ResultsFolder(copied(fresh, tmp_path_factory.mktemp("harmed") / "copy"))
    rows = moved(copy.path)
    ids = rows["id"].tolist()
    by_steps = rows.sort_values("steps")["id"].tolist()
    cut, empty, swapped, gone, other = by_steps[:5]
    longest = copy.trace(by_steps[-1]).read_bytes()
    copy.trace(cut).write_bytes(copy.trace(cut).read_bytes()[:2000])
    copy.trace(empty).write_bytes(b"")
    copy.trace(swapped).write_bytes(longest)
    copy.trace(gone).unlink()
    copy.trace(other).rename(copy.trace("0" * 16))
    changed(
        copy.path,
        f"UPDATE trials SET {', '.join(f'{name} = -1' for name in METRICS)}",
        "UPDATE trials SET message = 'x', wall_time_s = 9",
        f"UPDATE trials SET id = '{'0' * 16}' WHERE id = '{other}'",
        "ALTER TABLE trials DROP COLUMN lag_max_s",
        "ALTER TABLE trials DROP COLUMN position_error_rms_m",
    )
    with pytest.raises(DikbenchError, match=r"it lacks 'lag_max_s'.*`dikbench recompute`"):
        copy.open_store()
    errors = io.StringIO()
    with redirect_stderr(errors):
        done = recompute_results(copy.path, 2, "")
    return Harmed(copy.path, done, errors.getvalue(), ids, [cut, empty, swapped], gone, other)


def test_metrics_that_were_tampered_with_or_lost_are_restored(fresh: Path, harmed: Harmed) -> None:
    """All of them, to the bit, in columns that an older store lacks as well."""
    kept = {*harmed.bad, harmed.gone, harmed.other}
    whole = [name for name in harmed.ids if name not in kept]
    found = moved(harmed.folder).set_index("id").loc[whole, [*METRICS]]
    expected = moved(fresh).set_index("id").loc[whole, [*METRICS]]
    assert len(whole) > 5
    pd.testing.assert_frame_equal(found, expected, check_exact=True)
    exported = pd.read_parquet(harmed.folder / "trials.parquet").set_index("id")
    pd.testing.assert_frame_equal(exported.loc[whole, [*METRICS]], expected, check_exact=True)


def test_nothing_but_metrics_is_touched(harmed: Harmed) -> None:
    """Not even a message or a time that is wrong."""
    found = load_results(harmed.folder).trials
    assert set(found["message"]) == {"x"}
    assert set(found["wall_time_s"]) == {9.0}


def test_trials_that_cannot_be_recomputed_keep_their_values(harmed: Harmed) -> None:
    """Without a trace, with a bad one, or run with another law: counted, and nothing is lost."""
    found = moved(harmed.folder).set_index("id")["sigma_min"]
    kept = {*harmed.bad, harmed.gone, "0" * 16}
    assert set(found.index[found == -1]) == kept
    number = len(harmed.ids) - 5
    assert str(harmed.done) == (
        f"{number} trials recomputed; left as they were: 1 without a trace, "
        "1 whose formulation or scenario has changed since, 3 whose trace cannot be used"
    )


def test_a_trace_that_cannot_be_used_is_named(harmed: Harmed) -> None:
    """Truncated by a full disk, emptied, or swapped: a line with the trial and the reason."""
    lines = [line for line in harmed.errors.splitlines() if line.startswith("not recomputed: ")]
    assert len(lines) == 3
    reasons = ("not a trace of dikbench", "not a trace of dikbench", "not of this trial")
    for name, reason in zip(harmed.bad, reasons, strict=True):
        (line,) = (text for text in lines if f"({name})" in text)
        assert reason in line
        assert "seed 0" in line


def test_what_cannot_be_recomputed_is_one_line(fresh: Path, tmp_path: Path) -> None:
    """No results, another run at work, no trace at all, another schema."""
    with pytest.raises(DikbenchError, match=r"no results in .*: results.sqlite is missing"):
        recompute_here(tmp_path / "nowhere", 1, "")
    assert not (tmp_path / "nowhere").exists()
    copy = copied(fresh, tmp_path / "copy")
    with ResultsFolder(copy).lock(), pytest.raises(DikbenchError, match="another run is at work"):
        recompute_here(copy, 1, "")
    before = (copy / "trials.csv").read_bytes()
    for trace in (copy / "traces").iterdir():
        trace.unlink()
    with pytest.raises(DikbenchError, match=r"no traces in .*: they were not kept"):
        recompute_here(copy, 1, "")
    assert (copy / "trials.csv").read_bytes() == before
    changed(copy, "UPDATE meta SET value = '99' WHERE key = 'schema'")
    with pytest.raises(DikbenchError, match="schema version '99' is not known"):
        recompute_here(copy, 1, "")
