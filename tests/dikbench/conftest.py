"""What several test modules look at: a small run, and results that nobody had to run."""

from __future__ import annotations

import json
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any

import pandas as pd
import pytest

from dikbench.metrics import METRICS
from dikbench.report.write import write_report
from dikbench.results.columns import KEYS, TIMES
from dikbench.results.selected import with_selected
from dikbench.run.runner import RunSettings, run_study
from dikbench.study.study import Selection, load_study, select

Values = Mapping[str, Any]
MakeRows = Callable[..., pd.DataFrame]
WriteResults = Callable[..., Path]

FAULTLESS: Values = {
    "status": "ok",
    "message": "",
    "steps": 100,
    **{name: 0.0 for name in METRICS},
    "progress_mean": 1.0,
    "progress_min": 1.0,
    "velocity_peak_ratio": 0.5,
    "claimed_share": float("nan"),
    "verified_share": float("nan"),
    "disagreed_share": float("nan"),
    "wall_time_s": 0.1,
    "control_time_s": 0.05,
    "environment": "e",
    "run": 1,
    **dict.fromkeys(TIMES, float("nan")),
    "timing_stability": None,
}
"""A trial of a formulation without a solver, without a fault and without times."""


@pytest.fixture(scope="session")
def results(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The folder of a small run with every kind of law, a skipped pair and a path-indexed run."""
    out = tmp_path_factory.mktemp("run") / "out"
    selection = Selection(
        scenarios=("reach", "near-miss[miss=0.02]"), references=("time", "path"), seeds=(0, 1)
    )
    run_study(
        select(load_study("smoke"), selection, named=True), out, RunSettings(jobs=2), "a test"
    )
    write_report(out)
    return out


@pytest.fixture(scope="session")
def make_rows() -> MakeRows:
    """A function that makes a row per formulation, scenario and seed.

    Its first argument maps a formulation, or formulation and solver, to what differs from a
    faultless trial; a value may be a list, with an entry per scenario.
    """

    def make(
        formulations: Mapping[str | tuple[str, str], Values],
        scenarios: Sequence[str] = ("reach",),
        seeds: Sequence[int] = (0,),
        plant: str = "ideal",
        reference: str = "time",
    ) -> pd.DataFrame:
        rows = []
        for formulation, values in formulations.items():
            formulation, solver = (
                formulation if isinstance(formulation, tuple) else (formulation, "none")
            )
            for number, scenario in enumerate(scenarios):
                of_scenario = {
                    name: value[number] if isinstance(value, list) else value
                    for name, value in values.items()
                }
                for seed in seeds:
                    how = (formulation, solver, scenario, plant, reference, seed)
                    keys = dict(zip(KEYS, how, strict=False))
                    rows.append({"id": f"{len(rows)}", **keys, **FAULTLESS, **of_scenario})
        return with_selected(pd.DataFrame(rows))

    return make


@pytest.fixture(scope="session")
def write_results() -> WriteResults:
    """A function that writes rows as a committed results folder: trials.csv and manifest.json."""

    def write(folder: Path, rows: pd.DataFrame, **changes: Any) -> Path:
        folder.mkdir(parents=True, exist_ok=True)
        rows.to_csv(folder / "trials.csv", index=False)
        manifest = {
            "study": {
                "name": "made-up",
                "description": "Rows that nobody ran",
                "scenarios": list(dict.fromkeys(rows["scenario"])),
            },
            "trials": len(rows),
            "command": "dikbench run made-up",
            "libraries": {"dikbench": "0.1.0"},
            **changes,
        }
        (folder / "manifest.json").write_text(json.dumps(manifest), encoding="utf-8")
        return folder

    return write
