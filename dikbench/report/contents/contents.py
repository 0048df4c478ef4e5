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
from dikbench.report.tables.return_codes import return_codes
from dikbench.report.tables.table import Table
from dikbench.results.reading import Results
from dikbench.statistics.failures import SKIPPED, has_failed


@dataclass(frozen=True, eq=False)
class Contents:
    """What a report says.

    Attributes:
        results: what it is about.
        summary: what a person reads first.
        tables: success, outcomes, tracking error, limit violation, timing, solvers.
        failures: the worst failed trials.
        return_codes: a row per solver.
        families: the scenario families of the run.
        formulations: its formulations.
        limitations: what to keep in mind.
        figures: what was drawn.
    """

    results: Results
    summary: Summary
    tables: Sequence[Table]
    failures: Failures
    return_codes: pd.DataFrame
    families: Sequence[Family]
    formulations: Sequence[FormulationOfRun]
    limitations: Sequence[Limitation]
    figures: Sequence[Figure]

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
        """What the study is, in a sentence."""
        text = str(self.manifest["study"].get("description", "")).strip()
        return text if text.endswith((".", "?", "!")) or not text else f"{text}."

    @cached_property
    def counts(self) -> list[tuple[int, str]]:
        """How many trials were run, and how they ended; what did not occur is left out.

        Skipped cells are no trials: they are counted apart.
        """
        trials = self.results.trials
        status = trials["status"]
        formulations = trials[["formulation", "solver"]].drop_duplicates()
        seeds, scenarios = trials["seed"].nunique(), trials["scenario"].nunique()
        one = len(formulations) == 1
        found = [
            (ran := int(status.ne(SKIPPED).sum()), "trial run" if ran == 1 else "trials run"),
            (int(has_failed(trials).sum()), "failed"),
            (left := int(status.eq(SKIPPED).sum()), f"{'cell' if left == 1 else 'cells'} skipped"),
            (missing(trials, self.manifest), "missing"),
            (
                len(formulations),
                "formulation with its solver" if one else "formulations with their solvers",
            ),
            (scenarios, "scenario" if scenarios == 1 else "scenarios"),
            (seeds, "seed" if seeds == 1 else "seeds"),
        ]
        return [(count, what) for count, what in found if count or what in {"trials run", "failed"}]

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


def _versions(of: Any) -> str:
    return ", ".join(f"{name} {version}" for name, version in dict(of or {}).items())


def gather(results: Results, figures: Sequence[Figure]) -> Contents:
    """Say what results say.

    Args:
        results: rows and manifest.
        figures: what was drawn of them.
    """
    trials = results.trials
    return Contents(
        results,
        summarise(trials),
        make_tables(trials),
        failures(trials),
        return_codes(trials),
        families_of(trials),
        formulations_of(trials),
        limitations(trials, results.manifest, results.notes),
        figures,
    )
