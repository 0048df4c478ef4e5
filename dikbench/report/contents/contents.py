"""What a report says, whatever it is rendered to."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import pandas as pd

from dikbench.report.contents.formulations_and_families import (
    Family,
    FormulationOfRun,
    families_of,
    formulations_of,
)
from dikbench.report.drawing.figure import Figure
from dikbench.report.sentences.limitations import Limitation, limitations, missing
from dikbench.report.sentences.summary import Summary, summarise
from dikbench.report.tables.every import make_tables
from dikbench.report.tables.failures import Failures, failures
from dikbench.report.tables.instances import in_a_sentence, instances_table
from dikbench.report.tables.peers import NOTE, peers_table
from dikbench.report.tables.return_codes import return_codes
from dikbench.report.tables.table import Table
from dikbench.results.instances import read_attempts
from dikbench.results.peers import read_peers
from dikbench.results.reading import Results
from dikbench.statistics.failures import SKIPPED, has_failed, ran
from dikbench.statistics.trial_matrix import CONTENDER
from dikbench.study.instances import Attempt


@dataclass(frozen=True, eq=False)
class Contents:
    """What a report says.

    Attributes:
        results: what it is about.
        summary: what a person reads first.
        tables: success, outcomes, tracking error, limit violation, timing, solvers.
        failures: the worst failed trials.
        return_codes: a row per solver.
        peers: a row per peer, where peers were compared with.
        families: the scenario families of the run.
        formulations: its formulations.
        limitations: what to keep in mind.
        figures: what was drawn.
        attempts: the instances of the run, and what was rejected for them.
    """

    results: Results
    summary: Summary
    tables: Sequence[Table]
    failures: Failures
    return_codes: pd.DataFrame
    peers: pd.DataFrame
    families: Sequence[Family]
    formulations: Sequence[FormulationOfRun]
    limitations: Sequence[Limitation]
    figures: Sequence[Figure]
    attempts: Sequence[Attempt]

    @property
    def peers_note(self) -> str:
        """How peers were compared with."""
        return NOTE

    @property
    def manifest(self) -> Mapping[str, Any]:
        """The description of the run."""
        return self.results.manifest

    @property
    def name(self) -> str:
        """The study's name."""
        return str(self.manifest["study"].get("name") or self.results.folder.path.name)

    @property
    def description(self) -> str:
        """What the study is, in a sentence; said to be its plan where not all of it was run."""
        text = str(self.manifest["study"].get("description", "")).strip()
        if text and missing(self.results.trials, self.manifest, self.attempts):
            text = f"As it was planned: {text}"
        return text if text.endswith((".", "?", "!")) or not text else f"{text}."

    @cached_property
    def counts(self) -> list[tuple[int, str]]:
        """How many trials were run, and how they ended; what did not occur is left out.

        Skipped cells are no trials: they are counted apart. Where more was planned than ran, this
        is said of trials, formulations, scenarios and seeds.
        """
        trials, study = self.results.trials, self.manifest["study"]
        status, drawn = trials["status"], study.get("instances")
        rows = ran(trials)
        skipped = int(status.eq(SKIPPED).sum())
        absent = {"cells skipped", "missing"}
        found = [
            _of_plan(len(rows), int(self.manifest.get("trials", 0)), "trial run", "trials run"),
            (int(has_failed(trials).sum()), "failed"),
            (skipped, f"{'cell' if skipped == 1 else 'cells'} skipped"),
            (missing(trials, self.manifest, self.attempts), "missing"),
            _of_plan(
                len(rows[CONTENDER].drop_duplicates()),
                len(trials[CONTENDER].drop_duplicates()),
                "formulation with its solver",
                "formulations with their solvers",
            ),
            *(
                _of_plan(
                    rows[axis].nunique(),
                    len({*trials[axis], *(() if drawn else study.get(f"{axis}s", ()))}),
                    axis,
                    f"{axis}s",
                )
                for axis in ("scenario", "seed")
            ),
        ]
        return [(count, what) for count, what in found if count or what not in absent]

    @property
    def environment(self) -> list[tuple[str, str]]:
        """The machine and the versions, as far as the manifest knows them."""
        known = self.manifest
        libraries = _versions(known.get("libraries"))
        rows = (
            ("Started", known.get("started")),
            ("Commit", known.get("git_commit")),
            ("Machine", known.get("cpu")),
            ("Cores", known.get("cores")),
            ("Clock governor", known.get("governor")),
            ("System", known.get("system")),
            ("Python", known.get("python")),
            ("Linear algebra", known.get("blas")),
            ("Libraries", libraries),
            ("Solvers", _versions(known.get("solvers"))),
        )
        return [(name, str(value)) for name, value in rows if value]

    @property
    def manifest_text(self) -> str:
        """The manifest as it is stored."""
        return json.dumps(self.manifest, indent=2, ensure_ascii=False)


def _of_plan(count: int, planned: int, one: str, several: str) -> tuple[int, str]:
    """Name what was run, with how many were planned where these are more."""
    if planned > count:
        return count, f"of {planned} planned {several}"
    return count, one if count == 1 else several


def _versions(of: Any) -> str:
    return ", ".join(f"{name} {version}" for name, version in dict(of or {}).items())


def gather(results: Results, figures: Sequence[Figure]) -> Contents:
    """Say what results say.

    Args:
        results: rows and manifest.
        figures: what was drawn of them.
    """
    trials, attempts = results.trials, read_attempts(results.folder.path)
    rejections = [Limitation(in_a_sentence(instances_table(attempts)))] if attempts else []
    return Contents(
        results,
        summarise(trials),
        make_tables(trials),
        failures(trials),
        return_codes(trials),
        peers_table(read_peers(results.folder.path)),
        families_of(trials),
        formulations_of(trials),
        [*limitations(trials, results.manifest, results.notes, attempts), *rejections],
        figures,
        attempts,
    )
