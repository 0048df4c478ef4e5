"""The attempts at a study's instances, kept in its results folder as `instances.csv`."""

from __future__ import annotations

import csv
from collections.abc import Iterable
from pathlib import Path
from typing import Final

from dikbench.errors import DikbenchError
from dikbench.study.instances import COLUMNS, Attempt

INSTANCES: Final = "instances.csv"


def read_attempts(folder: Path) -> list[Attempt]:
    """Read the attempts of a results folder; none where it has no instances.

    Raises:
        DikbenchError: if the file is damaged.
    """
    path = folder / INSTANCES
    if not path.is_file():
        return []
    try:
        with path.open(newline="", encoding="utf-8") as file:
            rows = list(csv.DictReader(file, strict=True))
        return [
            Attempt(**{**row, "number": int(row["number"]), "seed": int(row["seed"])})  # type: ignore[arg-type]
            for row in rows
        ]
    except (OSError, UnicodeDecodeError, csv.Error, KeyError, TypeError, ValueError):
        raise DikbenchError(
            f"{path}: not a table of instances; valid: without it they are drawn anew"
        ) from None


def write_attempts(folder: Path, attempts: Iterable[Attempt]) -> None:
    """Write attempts in place of those of a results folder, all or none.

    Raises:
        DikbenchError: if the folder cannot be written.
    """
    path = folder / INSTANCES
    partial = path.with_name(path.name + ".partial")
    try:
        with partial.open("w", newline="", encoding="utf-8") as file:
            table = csv.writer(file, lineterminator="\n")
            table.writerow(COLUMNS)
            table.writerows([getattr(each, name) for name in COLUMNS] for each in attempts)
        partial.replace(path)
    except OSError as error:
        reason = error.strerror or str(error)
        raise DikbenchError(f"output folder {folder} cannot be written: {reason}") from None
