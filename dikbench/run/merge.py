"""The merge of results folders of one study, such as those of its shards."""

from __future__ import annotations

import os
import shutil
import sqlite3
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from datetime import UTC, datetime
from itertools import pairwise
from pathlib import Path
from typing import Any, Final

import msgspec

from dikbench.errors import DikbenchError
from dikbench.results.folder import ResultsFolder
from dikbench.results.instances import read_attempts, write_attempts
from dikbench.results.merging import copy_rows, positions_taken
from dikbench.results.peers import read_peers, write_peers
from dikbench.results.shards import MERGED, SHARD, TRIALS_OF_SHARD, shards_in
from dikbench.results.store import Store
from dikbench.results.versions import differences
from dikbench.run.progress_display import ProgressDisplay
from dikbench.run.provenance import environment, git_commit
from dikbench.run.shards import parse_shard
from dikbench.selector import parse_selector
from dikbench.study.study import Study

LEAST_FOLDERS: Final = 2

PARTIAL: Final = "results.sqlite.partial"


@dataclass(frozen=True)
class Part:
    """A results folder that is merged.

    Attributes:
        folder: the folder.
        runs: the descriptions of its runs.
        manifest: of the last one, with the versions that made the rows.
        metrics: descriptions of its metrics of other authors.
        solvers: names of the solvers of its rows.
        planned: the number of its rows that the plan has.
    """

    folder: ResultsFolder
    runs: Sequence[Mapping[str, Any]]
    manifest: Mapping[str, Any]
    metrics: Mapping[str, Mapping[str, Any]]
    solvers: frozenset[str]
    planned: int

    @property
    def environments(self) -> list[Mapping[str, Any]]:
        """The descriptions of what made its rows; of its last run, where it has none."""
        return list(self.manifest.get("environments", {}).values()) or [self.manifest]

    def __str__(self) -> str:
        """Name the folder."""
        return str(self.folder.path)


@dataclass(frozen=True)
class Merged:
    """What a merge came to.

    Attributes:
        done: number of trials of the study that the merged folder has.
        planned: number of its trials.
        missing: which shards are missing, wholly or in part.
    """

    done: int
    planned: int
    missing: tuple[str, ...]

    def __str__(self) -> str:
        """Summarise in one line."""
        told = f"{self.done} of {self.planned} trials"
        lacking = self.missing or ("the same command without --shard runs what is missing",)
        return told if self.done == self.planned else f"{told}; {'; '.join(lacking)}"


def merge_results(folders: Sequence[Path], out: Path, command: str) -> Merged:
    """Merge results folders of one study in another one, all or nothing.

    What is there of the same study is merged as well. Traces are linked where they can be.

    Args:
        folders: what is merged.
        out: where to.
        command: the command line, for the manifest.

    Raises:
        DikbenchError: if a folder has no results, is given twice, or is of another study, engine,
            source or version than the first; if two have one trial with different results; if the
            folder cannot be written. Nothing is changed then.
    """
    parts = [_part(ResultsFolder(folder)) for folder in folders]
    target = ResultsFolder(out)
    _check_folders([part.folder for part in parts], target)
    if target.database.is_file():
        parts = [_part(target), *parts]
    for part in parts[1:]:
        _check_same(parts[0], part)
    with target.lock():
        partial = target.path / PARTIAL
        try:
            _merge_rows(parts, partial, command)
            _link_traces(parts, target)
            _merge_tables(parts, target.path)
            for name in (f"{target.database.name}-wal", f"{target.database.name}-shm"):
                (target.path / name).unlink(missing_ok=True)
            partial.replace(target.database)
        except (OSError, sqlite3.Error) as error:
            reason = getattr(error, "strerror", None) or str(error)
            raise DikbenchError(f"output folder {target.path}: {reason}") from None
        finally:
            for suffix in ("", "-wal", "-shm"):
                partial.with_name(PARTIAL + suffix).unlink(missing_ok=True)
        with target.open_store() as store:
            target.export(store)
    planned = int(parts[0].manifest["trials"])
    return Merged(positions_taken(target.database), planned, tuple(_missing(parts)))


def _part(folder: ResultsFolder) -> Part:
    with folder.open_store() as store:
        planned = store.planned()
        return Part(
            folder,
            store.runs(),
            store.manifest(),
            store.other_metrics,
            frozenset(parse_selector(text).name for text in planned["solver"].unique()),
            len(planned),
        )


def _check_folders(folders: Sequence[ResultsFolder], out: ResultsFolder) -> None:
    if len(folders) < LEAST_FOLDERS:
        raise DikbenchError("merge takes two results folders or more")
    known: dict[Path, Path] = {}
    for folder in folders:
        if folder.path.resolve() in known:
            raise DikbenchError(f"{folder.path} is given twice; valid: each folder once")
        known[folder.path.resolve()] = folder.path
    if out.path.resolve() in known:
        raise DikbenchError(
            f"--out {out.path} is one of the folders that are merged; valid: another folder"
        )


def _check_same(one: Part, other: Part) -> None:
    """Check that two folders are of the same study, run in the same way.

    Raises:
        DikbenchError: if they are not.
    """
    where = f"{one} and {other} cannot be merged"
    studies = [_study(part) for part in (one, other)]
    if studies[0] != studies[1]:
        differing = [key for key in studies[0] if studies[0][key] != studies[1].get(key)]
        if "name" in differing:
            names = " and ".join(repr(study["name"]) for study in studies)
            raise DikbenchError(f"{where}: they are of the studies {names}; valid: one study")
        raise DikbenchError(
            f"{where}: their studies {studies[0]['name']!r} differ in {', '.join(differing)}; "
            "valid: one study"
        )
    engines = [part.manifest.get("engine", "alone") for part in (one, other)]
    if engines[0] != engines[1]:
        raise DikbenchError(
            f"{where}: their trials ran with engine={engines[0]} and engine={engines[1]}; valid: "
            "one engine"
        )
    mine, others = (part.manifest.get("sources", {}) for part in (one, other))
    if mine and others and mine != others:
        differing = [name for name in {**mine, **others} if mine.get(name) != others.get(name)]
        raise DikbenchError(
            f"{where}: the sources differ of {', '.join(differing)}; valid: one source"
        )
    if one.manifest["trials"] != other.manifest["trials"]:
        numbers = f"{one.manifest['trials']} and {other.manifest['trials']}"
        raise DikbenchError(f"{where}: their plans have {numbers} trials; valid: one plan")
    solvers = sorted(one.solvers | other.solvers)
    for pair in pairwise([*one.environments, *other.environments]):
        if found := differences(*pair, solvers):
            raise DikbenchError(
                f"{where}: their rows were made with {', '.join(found)}; valid: one version "
                "(`--rerun outdated` runs again what another one made)"
            )
    if one.metrics != other.metrics:
        every = {**one.metrics, **other.metrics}
        differing = [name for name in every if one.metrics.get(name) != other.metrics.get(name)]
        raise DikbenchError(
            f"{where}: they differ in the metrics {', '.join(differing)}; valid: the same in each, "
            "which `dikbench recompute --metric` computes"
        )


def _study(part: Part) -> dict[str, Any]:
    """Return the study of a folder, with what it did not know of at its default."""
    try:
        found: dict[str, Any] = msgspec.to_builtins(msgspec.convert(part.manifest["study"], Study))
    except msgspec.ValidationError as error:
        raise DikbenchError(f"{part}: its study cannot be read: {error}") from None
    return found


def _merge_rows(parts: Sequence[Part], partial: Path, command: str) -> None:
    """Write a new store with the rows of all parts."""
    for suffix in ("", "-wal", "-shm"):  # of a merge that was killed
        partial.with_name(PARTIAL + suffix).unlink(missing_ok=True)
    first = {
        key: value
        for key, value in parts[0].runs[-1].items()
        if key not in (SHARD, TRIALS_OF_SHARD)
    }
    merged = [
        {"folder": str(part), "shards": [*shards_in(part.runs)], "trials": part.planned}
        for part in parts
    ]
    with Store(partial) as store:
        store.add_other_metrics(parts[0].metrics)
        now = datetime.now(UTC).isoformat(timespec="seconds")
        own = {"started": now, **environment(git_commit(), command), MERGED: merged}
        run = store.begin_run({**first, **own}, [])
        store.close_neatly()
    names: list[str] = []
    with ProgressDisplay(len(parts), "merged folders") as display:
        for part in parts:
            there = f"{', '.join(names)} and {part}"
            copy_rows(part.folder.database, partial, [*part.metrics], run, there)
            names.append(str(part))
            display.advance()
    with Store(partial) as store:
        store.close_neatly()


def _link_traces(parts: Sequence[Part], out: ResultsFolder) -> None:
    """Give the merged folder the traces of all parts; a linked file takes no room."""
    for part in parts:
        if part.folder.path == out.path or not part.folder.traces.is_dir():
            continue
        for trace in part.folder.traces.glob("*.arrow"):
            file = out.traces / trace.name
            if file.exists():
                continue
            try:
                os.link(trace, file)
            except OSError:  # of another file system
                copied = file.with_name(f"{file.name}.partial")
                shutil.copyfile(trace, copied)
                copied.replace(file)


def _merge_tables(parts: Sequence[Part], out: Path) -> None:
    """Write the instances and the comparisons with peers of all parts; the first part's stay."""
    paths = [part.folder.path for part in parts]
    if attempts := dict.fromkeys(each for path in paths for each in read_attempts(path)):
        write_attempts(out, attempts)
    for path in reversed(paths):
        rows = read_peers(path).to_dict("records")
        write_peers(out, [{str(name): value for name, value in row.items()} for row in rows])


def _missing(parts: Sequence[Part]) -> Iterator[str]:
    """Say which shards are missing, wholly or in part."""
    shards = [shards_in(part.runs) for part in parts]
    for part, own in zip(parts, shards, strict=True):
        planned = sum(own.values())
        if own and part.planned < planned:
            yield f"{part} lacks {planned - part.planned} of {planned} of shard {', '.join(own)}"
    if all(shards):
        given = {parse_shard(text) for own in shards for text in own}
        for of in sorted({shard.of for shard in given}):
            numbers = {shard.number for shard in given if shard.of == of}
            lacking = sorted(set(range(1, of + 1)) - numbers)
            if lacking:
                yield "not given: " + ", ".join(f"shard {number}/{of}" for number in lacking)
