"""Finding a trial to be replayed: by its id, the beginning of it, or its trace."""

from __future__ import annotations

import os
import shutil
from pathlib import Path

import numpy as np
import pytest

from dikbench.errors import DikbenchError
from dikbench.results.folder import ResultsFolder
from dikbench.results.reading import load_results
from dikbench.simulation.trace import Trace
from dikbench.viewer.recording import find_recording, newest_results


def ids(runs: Path) -> list[str]:
    """The ids of the trials."""
    return list(load_results(runs / "runs" / "viewed").trials["id"])


def test_an_id_its_beginning_and_its_trace_are_the_same(
    runs: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """All three find the trial, its trace and its scenario."""
    monkeypatch.chdir(runs)
    name = ids(runs)[0]
    found = [find_recording(text) for text in (name, name[:8], f"runs/viewed/traces/{name}.arrow")]
    assert {recording.id for recording in found} == {name}
    assert found[0].is_current
    assert found[0].trial.scenario.name == "speed-sweep"
    trace = Trace.load(ResultsFolder(Path("runs/viewed")).trace(name))
    for recording in found:
        np.testing.assert_array_equal(recording.trace.q, trace.q)
        np.testing.assert_array_equal(recording.scenario.q0, trace.q[0])


def test_a_trace_beside_committed_results(runs: Path, tmp_path: Path) -> None:
    """The store is not needed, and a trace may lie anywhere if its results are named."""
    name = ids(runs)[1]
    for file in ("trials.csv", "manifest.json"):
        shutil.copy(runs / "runs" / "viewed" / file, tmp_path)
    (tmp_path / "else").mkdir()
    trace = shutil.copy(ResultsFolder(runs / "runs" / "viewed").trace(name), tmp_path / "else")
    found = find_recording(str(trace), tmp_path)
    assert str(found.trial.scenario) == "reach[robot=ur5,duration=0.2]"


def test_the_newest_results_are_the_default(tmp_path: Path) -> None:
    """The folder below runs/ that was written last, of those that hold results."""
    for age, name in enumerate(("empty", "new", "old")):
        (tmp_path / name).mkdir()
        if name != "empty":
            (tmp_path / name / "trials.csv").touch()
            os.utime(tmp_path / name / "trials.csv", (1e9 - age, 1e9 - age))
    assert newest_results(tmp_path) == tmp_path / "new"


def test_what_is_not_found_is_one_line(runs: Path, tmp_path: Path) -> None:
    """Nothing, too much, no trace, no results, a file that is none."""
    results = runs / "runs" / "viewed"
    with pytest.raises(DikbenchError, match=r"no trial of .* begins with 'none'"):
        find_recording("none", results)
    with pytest.raises(DikbenchError, match=f"2 trials of .*: {ids(runs)[0]}, {ids(runs)[1]}"):
        find_recording("", results)
    with pytest.raises(DikbenchError, match=r"trace not found: missing\.arrow"):
        find_recording("missing.arrow")
    with pytest.raises(DikbenchError, match=r"no results below .*runs: name a folder"):
        newest_results(tmp_path / "runs")
    for file in ("trials.csv", "manifest.json"):
        shutil.copy(results / file, tmp_path)
    with pytest.raises(DikbenchError, match=r"\(ok\) has no trace in .*--traces all"):
        find_recording(ids(runs)[0], tmp_path)


def test_a_law_that_has_changed_since_is_told(runs: Path, tmp_path: Path) -> None:
    """A recording whose id is not that of its selectors today is not current."""
    results = runs / "runs" / "viewed"
    name = ids(runs)[1]
    for file in ("trials.csv", "manifest.json"):
        text = (results / file).read_text().replace(name, "0123456789abcdef")
        (tmp_path / file).write_text(text)
    (tmp_path / "traces").mkdir()
    shutil.copy(ResultsFolder(results).trace(name), tmp_path / "traces" / "0123456789abcdef.arrow")
    assert not find_recording("0123", tmp_path).is_current
