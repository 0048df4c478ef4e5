"""Reading of exported results, which are committed without their store."""

from __future__ import annotations

import csv
import io
import json
from pathlib import Path
from typing import Any, Final

import pandas as pd

from dikbench.errors import DikbenchError
from dikbench.metrics import OUTCOME_TEXTS
from dikbench.results.columns import KEYS, REDEFINED, RENAMED, RENAMED_METRICS

TRIALS: Final = "trials.csv"
PARQUET: Final = "trials.parquet"
MANIFEST: Final = "manifest.json"

TEXT: Final = (
    "id",
    *(key for key in KEYS if key != "seed"),
    *OUTCOME_TEXTS,
    "environment",
    "timing_stability",
)
NEEDED: Final = tuple(name for name in KEYS if name != "message")
"""Columns that every row must have."""


def are_exported(folder: Path) -> bool:
    """Say whether a folder holds exported trials, as CSV or as Parquet."""
    return (folder / TRIALS).is_file() or (folder / PARQUET).is_file()


def read_trials(folder: Path, notes: list[str]) -> pd.DataFrame:
    """Read the trials as the store had them; columns unknown then are missing.

    Args:
        folder: the results folder.
        notes: a sentence about damaged rows that are left out is appended.

    Raises:
        DikbenchError: if there are none, or they are damaged.
    """
    if not (folder / TRIALS).is_file() and (folder / PARQUET).is_file():
        return _named_as_today(_parquet(folder / PARQUET))
    trials = _named_as_today(_rows(folder / TRIALS, notes))
    columns = {}
    for name, texts in trials.items():
        if name not in TEXT:
            columns[name] = _numbers(texts)
        elif name not in ("message", *OUTCOME_TEXTS):
            columns[name] = texts.replace("", None)
        else:
            columns[name] = texts
    return pd.DataFrame(columns)


def _named_as_today(trials: pd.DataFrame) -> pd.DataFrame:
    """Rename the columns of older results, without metrics that have another definition today."""
    if not trials.columns.isin(list(RENAMED_METRICS)).any():
        return trials.rename(columns=RENAMED)
    return trials.drop(columns=list(REDEFINED), errors="ignore").rename(columns=RENAMED)


def read_manifest(folder: Path) -> dict[str, Any]:
    """Read the description of the run.

    Raises:
        DikbenchError: if it cannot be read.
    """
    path = folder / MANIFEST
    try:
        found: dict[str, Any] = json.loads(path.read_text(encoding="utf-8"))
    except (OSError, ValueError) as error:
        reason = getattr(error, "strerror", None) or str(error)
        raise DikbenchError(f"{path} cannot be read: {reason}") from None
    return found


def _parquet(file: Path) -> pd.DataFrame:
    try:
        trials = pd.read_parquet(file)
    except (OSError, ValueError) as error:  # with Arrow's own errors
        reason = " ".join(str(error).split())
        raise DikbenchError(f"{file}: not a table of trials: {reason}") from None
    for name in NEEDED:
        if name not in trials:
            raise DikbenchError(f"{file}: not a table of trials: it has no column {name!r}")
    return trials


def _rows(file: Path, notes: list[str]) -> pd.DataFrame:
    """Read the rows of a CSV file as texts, except those that are cut off or too long."""
    if not file.is_file():
        raise DikbenchError(
            f"no results in {file.parent}: none of results.sqlite, {PARQUET} and {file.name} is "
            "there"
        )
    try:
        text = file.read_text(encoding="utf-8")
        lines = list(csv.reader(io.StringIO(text, newline="")))
    except (OSError, UnicodeDecodeError, csv.Error) as error:
        raise DikbenchError(f"{file}: not a table of trials: {error}") from None
    header = lines[0] if lines else []
    for name in NEEDED:
        if header.count(name) != 1:
            often = "no column" if name not in header else "more than one column"
            raise DikbenchError(f"{file}: not a table of trials: it has {often} {name!r}")
    ended = (
        lines[1:] if text.endswith("\n") else lines[1:-1]
    )  # a value that was cut may look complete
    whole = [line for line in ended if len(line) == len(header)]
    rows = pd.DataFrame(whole, columns=header)
    rows = rows.loc[:, ~rows.columns.duplicated()]
    rows = rows[(rows[list(NEEDED)] != "").all(axis=1)]
    if len(rows) < len(lines) - 1:
        left_out = len(lines) - 1 - len(rows)
        notes.append(f"{file.name} is damaged: {left_out} of {len(lines) - 1} rows are left out.")
    return rows.reset_index(drop=True)


def _numbers(texts: pd.Series) -> pd.Series:
    """Convert texts to integers where all are, else to floats, else leave them as they are.

    Python converts them, since pandas is wrong in the last bit.
    """
    values = [text or "nan" for text in texts.tolist()]
    kinds: tuple[type, ...] = (int, float)
    for kind in kinds:
        try:
            return pd.Series([kind(value) for value in values], texts.index, kind)
        except (ValueError, OverflowError):
            continue
    return texts
