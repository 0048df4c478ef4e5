"""What is left of a run: its store, or the files that were committed instead of it."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final

import msgspec
import pandas as pd

from dikbench.errors import DikbenchError
from dikbench.metrics import METRICS
from dikbench.report.sentences.words import several
from dikbench.results.columns import KEYS, TIMES
from dikbench.results.exports import MANIFEST, are_exported, read_manifest, read_trials
from dikbench.results.folder import ResultsFolder
from dikbench.selector import parse_selector

TEXTS: Final = ("id", *KEYS, "environment", "timing_verdict")
NUMBERS: Final = (
    "seed",
    "steps",
    *METRICS,
    "wall_time_s",
    "control_time_s",
    *(name for name, (kind, _) in TIMES.items() if kind != "TEXT"),
)
SELECTORS: Final = ("formulation", "solver", "scenario", "plant")


class _Cells(msgspec.Struct):
    formulations: tuple[str, ...]
    solvers: tuple[str, ...] = ()


class _Study(msgspec.Struct):
    name: str = ""
    description: str = ""
    example: str = ""
    cells: tuple[_Cells, ...] = ()
    scenarios: tuple[str, ...] = ()
    plants: tuple[str, ...] = ()
    references: tuple[str, ...] = ()
    seeds: tuple[int, ...] = ()


class Manifest(msgspec.Struct):
    """What a report reads of a manifest; other versions may say more, and less."""

    study: _Study
    trials: int = 0
    command: str = ""
    libraries: dict[str, str | None] = {}
    solvers: dict[str, str | None] = {}


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
            if trials.empty:
                raise DikbenchError(f"no results in {path}: no trial has ended yet")
        except DikbenchError as error:
            if not are_exported(path):
                raise
            notes.append(f"Read from trials.csv, for the store cannot be read: {error}.")
        else:
            if len(versions) > 1:
                notes.append(f"Rows were made by different versions: {', '.join(versions)}.")
            return Results(folder, trials, manifest, tuple(notes))
    trials = _complete(read_trials(path, notes), notes)
    if trials.empty:
        raise DikbenchError(f"no results in {path}: there is no row of a trial that can be read")
    environments = trials["environment"].nunique()
    if environments > 1:
        notes.append(f"Rows were made in {environments} different environments.")
    return Results(folder, trials, _manifest(path, notes), tuple(notes))


def _version(environment: dict[str, Any]) -> str:
    commit = environment.get("git_commit")
    version = f"dikbench {environment.get('libraries', {}).get('dikbench', 'unknown')}"
    return f"{version} (commit {commit[:8]}{'+' * commit.endswith('+')})" if commit else version


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
    whole = found[["seed", "steps"]].abs().lt(2**31).all(axis=1) & _named(found)
    if not whole.all():
        notes.append(
            f"{several(int((~whole).sum()), 'row')} without a seed, steps or a selector that can "
            "be read left out."
        )
    return found[whole].astype({"seed": int, "steps": int}).reset_index(drop=True)


def _named(rows: pd.DataFrame) -> pd.Series:
    """Which rows have names that are selectors."""
    named = pd.Series(True, rows.index)
    for column in SELECTORS:
        readable = {text for text in rows[column].unique() if _is_selector(text)}
        named &= rows[column].isin(readable)
    return named


def _is_selector(text: str) -> bool:
    try:
        parse_selector(text)
    except DikbenchError:
        return False
    return True


def _manifest(folder: Path, notes: list[str]) -> dict[str, Any]:
    """The description of a run; a short one in its place where it cannot be read."""
    try:
        found = read_manifest(folder)
        msgspec.convert(found, Manifest)
    except (DikbenchError, msgspec.ValidationError) as error:
        notes.append(f"The machine and the study are not known: {MANIFEST}: {error}.")
        return {"study": {"name": folder.name, "description": "Results without a manifest"}}
    return found
