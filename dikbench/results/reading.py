"""The reader of results folders: from the store, else from the exported files."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, Final

import msgspec
import pandas as pd

from dikbench.errors import DikbenchError
from dikbench.metrics import METRICS, OUTCOME_NUMBERS, OUTCOME_TEXTS
from dikbench.results.columns import ASKED, DESCRIBED, KEYS, SEES, SELECTORS, TIMES
from dikbench.results.exports import MANIFEST, are_exported, read_manifest, read_trials
from dikbench.results.folder import ResultsFolder
from dikbench.results.selected import selected_columns, with_selected
from dikbench.results.step_frames import steps_of
from dikbench.results.store import OtherVersion
from dikbench.selector import parse_selector

TEXTS: Final = ("id", *KEYS, *OUTCOME_TEXTS, "environment", "timing_stability")
NUMBERS: Final = (
    "seed",
    "steps",
    *METRICS,
    *OUTCOME_NUMBERS,
    *SEES,
    *ASKED,
    "wall_time_s",
    "control_time_s",
    *(name for name, (kind, _) in TIMES.items() if kind != "TEXT"),
)


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
    """The parts of a manifest that a report uses; other versions may have more or less."""

    study: _Study
    trials: int = 0
    command: str = ""
    libraries: dict[str, str | None] = {}
    solvers: dict[str, str | None] = {}


@dataclass(frozen=True, eq=False)
class Results:
    """The contents of a results folder.

    Attributes:
        folder: the folder.
        manifest: how the run was made: study, versions, machine, command.
        trials: a row per trial: the columns of trials.csv, and for each selector its name and its
            parameters as columns of their own (`formulation_name`, `formulation_damping`,
            `scenario_family`, `scenario_miss`, ...), missing where a selector does not name them.
            `attrs["units"]` and `attrs["definitions"]` say what a column is in.
        notes: sentences about what is missing or left out, where results are read leniently.
    """

    folder: ResultsFolder
    manifest: dict[str, Any]
    trials: pd.DataFrame
    notes: tuple[str, ...] = ()

    def steps(self, trials: pd.DataFrame | Iterable[str] | None = None) -> pd.DataFrame:
        """Read the control steps of trials from their traces, a row per trial and step.

        Args:
            trials: rows of `trials`, or ids of trials; default: all that have a trace.

        Returns:
            Columns `id`, `step`, `time_s`, `tau_s`, `status`, ..., and `q_0`, `applied_0`, ... per
            coordinate, NaN where a robot has fewer; units and definitions as in `trials`.

        Raises:
            DikbenchError: if no traces are stored, or an id is unknown.
        """
        if trials is None:
            trials = self.trials
        ids = list(trials["id"] if isinstance(trials, pd.DataFrame) else trials)
        unknown = set(ids) - set(self.trials["id"])
        if unknown:
            raise DikbenchError(
                f"no trial of {self.folder.path} has the id {min(unknown)!r}; valid: those in "
                "trials.id"
            )
        return steps_of(self.folder, ids)


def load_results(folder: str | Path) -> Results:
    """Load a results folder, with its store or without it, as it is committed.

    Args:
        folder: what `dikbench run` wrote.

    Raises:
        DikbenchError: if the folder holds no results, or they are damaged.
    """
    return read_results(Path(folder))


def read_results(path: Path, *, lenient: bool = False) -> Results:
    """Read a results folder: the store where there is one, else trials and manifest as exported.

    Columns of older results get today's names.

    Args:
        path: the folder.
        lenient: whether to note what is missing or damaged instead of raising, and to return the
            rest with every column that this version knows.

    Raises:
        DikbenchError: if the folder holds no results or, unless lenient, they are damaged.
    """
    folder = ResultsFolder(path)
    trials, manifest, notes = _stored_or_exported(folder, lenient=lenient)
    if lenient:
        trials = _complete(trials, notes, _other_metrics(manifest))
        if trials.empty:
            raise DikbenchError(f"no results in {path}: there is no row of a trial to be read")
    elif notes:
        raise DikbenchError(f"{notes[0]} `dikbench report` reads what is left.")
    try:
        trials = with_selected(trials)
    except DikbenchError as error:
        raise DikbenchError(f"{path}: {error}") from None
    # Columns that were added one by one lie apart, which pandas warns about.
    return Results(folder, manifest, _described(trials.copy(), manifest), tuple(notes))


def without_attributes(results: Results) -> Results:
    """Return results whose rows carry no units and definitions.

    Every operation of pandas copies the attributes of a frame, which takes far longer than the
    operation itself.
    """
    trials = results.trials.copy()
    trials.attrs = {}
    return replace(results, trials=trials)


def _stored_or_exported(
    folder: ResultsFolder, *, lenient: bool
) -> tuple[pd.DataFrame, dict[str, Any], list[str]]:
    notes: list[str] = []
    if folder.database.is_file():
        try:
            with folder.open_store() as store:
                trials, manifest = store.trials(), store.manifest()
        except DikbenchError as error:
            if not are_exported(folder.path) or not (lenient or isinstance(error, OtherVersion)):
                raise
            if lenient:
                notes.append(f"Read from trials.csv, for the store cannot be read: {error}.")
        else:
            return trials, manifest, [*notes, *(_several_versions(manifest) if lenient else ())]
    trials = read_trials(folder.path, notes)
    if not lenient:
        return trials, read_manifest(folder.path), notes
    manifest = _manifest(folder.path, notes)
    return trials, manifest, [*notes, *_several_versions(manifest)]


def _several_versions(manifest: dict[str, Any]) -> list[str]:
    """Say which versions made the rows, where several did."""
    described = manifest.get("environments", {}).values()
    versions = {_version(made) for made in described}
    for kind in ("libraries", "solvers"):
        for name, together in manifest.get(kind, {}).items():
            if name != "dikbench" and ", " in str(together):
                versions.add(f"{name} {together}")
    dikbench = sum(text.startswith("dikbench ") for text in versions)
    if len(versions) == dikbench <= 1:
        return []
    told = sorted(text for text in versions if dikbench > 1 or not text.startswith("dikbench "))
    return [
        f"Rows were made by different versions: {'; '.join(told)}. `--rerun outdated` runs again "
        "what this one did not make."
    ]


def _version(environment: dict[str, Any]) -> str:
    commit = environment.get("git_commit")
    version = f"dikbench {environment.get('libraries', {}).get('dikbench', 'unknown')}"
    return f"{version} (commit {commit[:8]}{'+' * commit.endswith('+')})" if commit else version


def metrics_described(manifest: Mapping[str, Any]) -> dict[str, dict[str, Any]]:
    """Return what a manifest says of metrics of other authors, by name."""
    told = manifest.get("metrics")
    found = told.items() if isinstance(told, dict) else ()
    return {str(name): each for name, each in found if isinstance(each, dict)}


def metrics_in(path: Path) -> dict[str, dict[str, Any]]:
    """Return what a results folder says of metrics of other authors; nothing where it has none."""
    folder = ResultsFolder(path)
    try:
        if folder.database.is_file():
            with folder.open_store() as store:
                return store.other_metrics
        return metrics_described(read_manifest(path))
    except DikbenchError:  # which is told when its rows are read
        return {}


def _other_metrics(manifest: Mapping[str, Any]) -> dict[str, tuple[str, str]]:
    """Return unit and definition of the metrics of other authors that a manifest describes."""
    return {
        name: (str(each.get("unit", "")), str(each.get("definition", "")))
        for name, each in metrics_described(manifest).items()
    }


def _complete(rows: pd.DataFrame, notes: list[str], others: Iterable[str]) -> pd.DataFrame:
    """Return the rows with every known column, and those of others, numbers as numbers or empty."""
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
            for name in (*NUMBERS, *others)
        },
    }
    found = pd.DataFrame(columns, index=rows.index)
    found["timing_stability"] = found["timing_stability"].replace("", None)
    whole = found[["seed", "steps"]].abs().lt(2**31).all(axis=1) & _named(found)
    if not whole.all():
        count = int((~whole).sum())
        notes.append(
            f"{count} {'row' if count == 1 else 'rows'} without a seed, steps or a selector that "
            "can be read left out."
        )
    typed = found[whole].astype({"seed": int, "steps": int}).reset_index(drop=True)
    return typed.copy()  # astype leaves every column on its own, which pandas warns about


def _named(rows: pd.DataFrame) -> pd.Series:
    """Say which rows have names that are selectors."""
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
    """Read the description of a run, or return a short one where it cannot be read."""
    try:
        found = read_manifest(folder)
        msgspec.convert(found, Manifest)
    except (DikbenchError, msgspec.ValidationError) as error:
        notes.append(f"The machine and the study are not known: {MANIFEST}: {error}.")
        return {"study": {"name": folder.name, "description": "Results without a manifest"}}
    return found


def _described(trials: pd.DataFrame, manifest: dict[str, Any]) -> pd.DataFrame:
    """Attach units and definitions of the columns; empty where unknown to this version."""
    known = {
        **_other_metrics(manifest),
        **DESCRIBED,
        **{metric.name: (metric.unit, metric.definition) for metric in METRICS.values()},
    }
    for column, head in SELECTORS.items():
        parts = {head: f"{column}_{head}", **selected_columns(trials, column)}
        known |= {of: ("", f"{part} in the selector of the {column}") for part, of in parts.items()}
    found = {name: known.get(name, ("", "")) for name in map(str, trials)}
    trials.attrs["units"] = {name: unit for name, (unit, _) in found.items()}
    trials.attrs["definitions"] = {name: text for name, (_, text) in found.items()}
    return trials
