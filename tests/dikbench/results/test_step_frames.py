"""The control steps of trials as data frames: those of the traces, with units."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pandas as pd
import pytest

import dikbench
from dikbench.errors import DikbenchError
from dikbench.results.folder import ResultsFolder
from dikbench.simulation.trace import Trace


def test_steps_are_those_of_the_traces(stored: Path) -> None:
    """A row per trial and step with the trace's numbers; a robot of 3 joints has no fourth."""
    results = dikbench.load_results(stored)
    steps = results.steps()
    ran = results.trials[results.trials["status"] == "ok"].set_index("id")
    assert dict(steps.groupby("id").size()) == dict(ran["steps"])
    for name, rows in steps.groupby("id"):
        trace = Trace.load(ResultsFolder(stored).trace(str(name)))
        np.testing.assert_array_equal(rows["time_s"], trace.dt * np.arange(trace.steps))
        joints = trace.applied.shape[1]
        applied = rows[[f"applied_{number}" for number in range(joints)]]
        np.testing.assert_array_equal(applied, trace.applied)
        assert rows.filter(like="applied_").shape[1] == 7
        assert rows.filter(like="applied_").iloc[:, joints:].isna().all(axis=None)
    assert list(steps.attrs["units"]) == list(steps.columns)
    assert all(steps.attrs["definitions"].values())


def test_steps_of_some_trials(stored: Path) -> None:
    """Rows of the trials, or ids, choose; none is none, and an unknown id is an error."""
    results = dikbench.load_results(stored)
    chosen = results.trials.query("scenario_robot == 'planar3r' and status == 'ok'")
    by_rows, by_ids = results.steps(chosen), results.steps(list(chosen["id"]))
    pd.testing.assert_frame_equal(by_rows, by_ids)
    assert set(by_rows["id"]) == set(chosen["id"])
    with pytest.raises(DikbenchError, match="no traces"):
        results.steps([])
    with pytest.raises(DikbenchError, match="has the id 'beef'"):
        results.steps(["beef"])
