"""What a run exports, read back: results that were committed without their store."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any, Final

import pandas as pd

from dikbench.errors import DikbenchError
from dikbench.run.columns import KEYS

TRIALS: Final = "trials.csv"
MANIFEST: Final = "manifest.json"

TEXT: Final = ("id", *(key for key in KEYS if key != "seed"), "environment", "timing_verdict")


def are_exported(folder: Path) -> bool:
    """Whether a folder holds the exports of a run."""
    return (folder / TRIALS).is_file() and (folder / MANIFEST).is_file()


def read_exports(folder: Path) -> tuple[pd.DataFrame, dict[str, Any]]:
    """The trials and the manifest, as the store had them; columns that were not known then lack.

    Raises:
        DikbenchError: if they are not there, or not what a run writes.
    """
    trials = _table(folder / TRIALS)
    trials["message"] = trials["message"].fillna("")
    path = folder / MANIFEST
    try:
        manifest: dict[str, Any] = json.loads(path.read_text(encoding="utf-8"))
    except (OSError, ValueError) as error:
        raise DikbenchError(f"{path} cannot be read: {error}") from None
    return trials, manifest


def _table(path: Path) -> pd.DataFrame:
    try:
        # As text first: pandas' own reader of numbers errs in the last bit, and takes "NA" for one.
        table = pd.read_csv(path, dtype=str, keep_default_na=False, na_values=[""])
    except (OSError, ValueError) as error:  # pandas' own are among them
        raise DikbenchError(f"{path} cannot be read: {error}") from None
    missing = [name for name in KEYS if name not in table]
    if missing:
        raise DikbenchError(f"{path} is no table of dikbench: it lacks the column {missing[0]!r}")
    for name in table.columns.difference([*TEXT]):
        table[name] = _numbers(table[name])
    return table


def _numbers(texts: pd.Series) -> pd.Series:
    """Integers where all are, else floats, else what they were."""
    kinds: tuple[type, ...] = (int, float)
    for kind in kinds:
        try:
            return texts.astype(kind)
        except (ValueError, TypeError):
            continue
    return texts
