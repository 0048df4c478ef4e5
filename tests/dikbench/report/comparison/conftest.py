"""Results folders without a store, made by hand."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import pandas as pd
import pytest
from makers.rows import make_rows, write_results

from dikbench.metrics import METRICS

Change = Callable[[pd.DataFrame], Any]

MANIFEST = {
    "git_commit": "aaa",
    "cpu": "one core",
    "cores": 1,
    "libraries": {"numpy": "2.0", "pin": "4.1"},
    "solvers": {"daqp": "0.7"},
}
HALF = {
    **dict.fromkeys(METRICS, 0.5),
    "formulation_time_median_us": 10.0,
    "formulation_time_p99_us": 20.0,
    "timing_stability": "stable",
}
SCENARIOS = ("reach", "near-miss[miss=0.1]", "near-miss[miss=0.2]")


def trials() -> pd.DataFrame:
    """Two formulations on three scenarios of two families, two seeds each; every metric is 0.5."""
    return make_rows({"dls": HALF, ("qp", "daqp"): HALF}, SCENARIOS, (0, 1))


@pytest.fixture
def folder(tmp_path: Path) -> Callable[..., Path]:
    """Write a folder without a store: the trials above with a change, the manifest with others."""

    def write(name: str, change: Change = lambda table: None, **manifest: Any) -> Path:
        table = trials()
        changed = change(table)
        table = changed if isinstance(changed, pd.DataFrame) else table
        return write_results(tmp_path / name, table, **{**MANIFEST, **manifest})

    return write
