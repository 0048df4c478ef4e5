"""What is left of a run: its store, or the files that were committed instead of it."""

from __future__ import annotations

import csv
import io
import json
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final

import pandas as pd

from dikbench.errors import DikbenchError
from dikbench.metrics import METRICS
from dikbench.run.columns import KEYS, TIMES
from dikbench.run.results import ResultsFolder

TEXTS: Final = ("id", *KEYS, "environment", "timing_verdict")
NUMBERS: Final = (
    "seed",
    "steps",
    *METRICS,
    "wall_time_s",
    "control_time_s",
    *(name for name, (kind, _) in TIMES.items() if kind != "TEXT"),
)
NEEDED: Final = tuple(name for name in KEYS if name != "message")
"""Columns without which a row says nothing."""


@dataclass(frozen=True, eq=False)
class Results:
    """The rows of a run and where they come from.

    Attributes:
        folder: the results folder.
        trials: a row per trial, with every column that this dikbench knows.
        manifest: the description of the run.
        notes: sentences about what is missing or was left out.
    """

    folder: ResultsFolder
    trials: pd.DataFrame
    manifest: dict[str, Any]
    notes: tuple[str, ...]


def read_results(path: Path) -> Results:
    """Read a results folder: the store where there is one, else trials.csv and manifest.json.

    Raises:
        DikbenchError: if the folder holds neither, or nothing of them can be read.
    """
    folder = ResultsFolder(path)
    notes: list[str] = []
    if folder.database.is_file():
        try:
            with folder.open_store() as store:
                manifest = store.manifest()
                versions = sorted({_version(made) for made in store.environments()})
                trials = _complete(store.trials(), notes)
        except DikbenchError as error:
            if not (path / "trials.csv").is_file():
                raise
            notes.append(f"Read from trials.csv, for the store cannot be read: {error}.")
        else:
            if len(versions) > 1:
                notes.append(f"Rows were made by different versions: {', '.join(versions)}.")
            return Results(folder, trials, manifest, tuple(notes))
    trials = _complete(_rows(path / "trials.csv", notes), notes)
    environments = trials["environment"].nunique()
    if environments > 1:
        notes.append(f"Rows were made in {environments} different environments.")
    return Results(folder, trials, _manifest(path / "manifest.json", notes), tuple(notes))


def _version(environment: dict[str, Any]) -> str:
    commit = environment.get("git_commit")
    version = f"dikbench {environment.get('libraries', {}).get('dikbench', 'unknown')}"
    return f"{version} (commit {commit[:8]}{'+' * commit.endswith('+')})" if commit else version


def _rows(file: Path, notes: list[str]) -> pd.DataFrame:
    """The rows of a CSV file as texts, without those that are cut off or have too many values."""
    if not file.is_file():
        raise DikbenchError(
            f"no results in {file.parent}: neither results.sqlite nor {file.name} is there"
        )
    try:
        text = file.read_text(encoding="utf-8")
        lines = list(csv.reader(io.StringIO(text, newline="")))
    except (OSError, UnicodeDecodeError, csv.Error) as error:
        raise DikbenchError(f"{file}: not a table of trials: {error}") from None
    header = lines[0] if lines else []
    missing = [name for name in NEEDED if name not in header]
    if missing:
        raise DikbenchError(f"{file}: not a table of trials: it has no column {missing[0]!r}")
    ended = lines[1:] if text.endswith("\n") else lines[1:-1]  # a value that was cut may look whole
    whole = [line for line in ended if len(line) == len(header)]
    rows = pd.DataFrame(whole, columns=header)
    rows = rows[(rows[list(NEEDED)] != "").all(axis=1)]
    if len(rows) < len(lines) - 1:
        left_out = len(lines) - 1 - len(rows)
        notes.append(f"{file.name} is damaged: {left_out} of {len(lines) - 1} rows are left out.")
    return rows.reset_index(drop=True)


def _complete(rows: pd.DataFrame, notes: list[str]) -> pd.DataFrame:
    """The rows with every known column, numbers as numbers; what is no number is empty."""
    lacking = [name for name in METRICS if name not in rows]
    if lacking:
        notes.append(
            f"The rows were written by a dikbench without {len(lacking)} of today's metrics "
            f"({', '.join(lacking)}), which stay empty."
        )
    columns = {
        **{name: rows[name].fillna("") if name in rows else "" for name in TEXTS},
        **{
            name: pd.to_numeric(rows[name], errors="coerce").astype(float)
            if name in rows
            else float("nan")
            for name in NUMBERS
        },
    }
    found = pd.DataFrame(columns, index=rows.index)
    found["timing_verdict"] = found["timing_verdict"].replace("", None)
    whole = found[["seed", "steps"]].notna().all(axis=1)
    if not whole.all():
        notes.append(f"{int((~whole).sum())} rows without a seed or steps are left out.")
    return found[whole].astype({"seed": int, "steps": int}).reset_index(drop=True)


def _manifest(file: Path, notes: list[str]) -> dict[str, Any]:
    """The description of a run; a short one in its place where it cannot be read."""
    try:
        found = json.loads(file.read_text(encoding="utf-8"))
        if isinstance(found, dict) and isinstance(found.get("study"), dict):
            return found
        reason = "it describes no study"
    except (OSError, UnicodeDecodeError, json.JSONDecodeError) as error:
        reason = getattr(error, "strerror", None) or str(error)
    notes.append(f"The machine and the study are not known: {file.name}: {reason}.")
    return {"study": {"name": file.parent.name, "description": "Results without a manifest"}}
