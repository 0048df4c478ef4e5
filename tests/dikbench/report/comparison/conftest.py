"""Results folders without a store, made by hand."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pandas as pd
import pytest

from dikbench.metrics import METRICS

Change = Callable[[pd.DataFrame], Any]

MANIFEST = {
    "git_commit": "aaa",
    "cpu": "one core",
    "cores": 1,
    "libraries": {"numpy": "2.0", "pin": "4.1"},
    "solvers": {"daqp": "0.7"},
}


def trials() -> pd.DataFrame:
    """Two formulations on three scenarios of two families, two seeds each; every metric is 0.5."""
    rows = [
        {
            "id": f"{formulation}-{scenario}-{seed}",
            "formulation": formulation,
            "solver": solver,
            "scenario": scenario,
            "plant": "ideal",
            "reference": "time",
            "seed": seed,
            "status": "ok",
            "message": "",
            "steps": 100,
            **dict.fromkeys(METRICS, 0.5),
            "formulation_time_median_us": 10.0,
            "formulation_time_p99_us": 20.0,
            "timing_stability": "stable",
        }
        for formulation, solver in (("dls", "none"), ("qp", "daqp"))
        for scenario in ("reach", "near-miss[miss=0.1]", "near-miss[miss=0.2]")
        for seed in (0, 1)
    ]
    return pd.DataFrame(rows)


@pytest.fixture
def folder(tmp_path: Path) -> Callable[..., Path]:
    """Write a folder without a store: the trials above with a change, the manifest with others."""

    def write(name: str, change: Change = lambda table: None, **manifest: Any) -> Path:
        path = tmp_path / name
        path.mkdir()
        table = trials()
        changed = change(table)
        table = changed if isinstance(changed, pd.DataFrame) else table
        table.to_csv(path / "trials.csv", index=False)
        (path / "manifest.json").write_text(json.dumps({**MANIFEST, **manifest}))
        return path

    return write
