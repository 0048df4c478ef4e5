"""The results of a run as files: trials.csv, manifest.json, traces."""

from __future__ import annotations

import json
import os
from collections.abc import Collection, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import pandas as pd

from dikbench.errors import DikbenchError
from dikbench.metrics import METRICS
from dikbench.run.worker import Row

KEYS = ("formulation", "solver", "scenario", "plant", "reference", "seed", "status", "message")
TIMES = {
    "law_time_median_us": "median time of one call of the law, its solver included [us]",
    "law_time_p99_us": "99 % quantile of it [us]",
    "solve_time_median_us": "median of the part inside the solver and its interface [us]",
    "timing_samples": "number of calls timed",
}
CELL = ["formulation", "solver", "scenario"]


@dataclass(frozen=True)
class ResultsFolder:
    """Where a run writes."""

    path: Path

    @property
    def traces(self) -> Path:
        """One compressed file of arrays per trial."""
        return self.path / "traces"

    @property
    def trials(self) -> Path:
        """The table of trials."""
        return self.path / "trials.csv"

    def prepare(self) -> None:
        """Make the folder, and make sure that it can be written; earlier results stay.

        Raises:
            DikbenchError: if it cannot.
        """
        try:
            self.traces.mkdir(parents=True, exist_ok=True)
        except OSError as error:
            reason = error.strerror or str(error)
            raise DikbenchError(f"output folder {self.path} cannot be written: {reason}") from None
        if not os.access(self.path, os.W_OK | os.X_OK) or not os.access(self.traces, os.W_OK):
            raise DikbenchError(f"output folder {self.path} cannot be written: permission denied")

    def forget_traces_but(self, names: Collection[str]) -> None:
        """Remove the traces of an earlier run into this folder: they belong to no row any more."""
        for path in self.traces.glob("*.arrow"):
            if path.stem not in names:
                path.unlink()

    def write(self, rows: Sequence[Row], times: Sequence[Row], manifest: dict[str, Any]) -> None:
        """Write the table and the manifest; each replaces its predecessor in one move."""
        columns = [*KEYS, "steps", *METRICS, *TIMES]
        frame = pd.DataFrame(list(rows))
        if times:
            frame = frame.merge(pd.DataFrame(list(times)), on=CELL, how="left")
        frame = frame.reindex(columns=columns)
        _replace(self.trials, frame.to_csv(index=False))
        text = json.dumps(manifest, indent=2, ensure_ascii=False) + "\n"
        _replace(self.path / "manifest.json", text)

    def read(self) -> tuple[pd.DataFrame, dict[str, Any]]:
        """The table of trials and the manifest.

        Raises:
            DikbenchError: if the folder holds no results.
        """
        if not self.trials.is_file():
            raise DikbenchError(f"no results in {self.path}: trials.csv is missing")
        frame = pd.read_csv(self.trials, keep_default_na=True)
        frame["message"] = frame["message"].fillna("")
        return frame, json.loads((self.path / "manifest.json").read_text())


def _replace(path: Path, text: str) -> None:
    partial = path.with_name(path.name + ".partial")
    partial.write_text(text)
    partial.replace(path)
