"""A comparison of two results folders, from reading them to what became worse."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import pandas as pd

from dikbench.report.comparison.differences import formulation_differences, trial_differences
from dikbench.report.comparison.matching import MatchedTrials, match_trials
from dikbench.report.comparison.times import time_ratios
from dikbench.report.comparison.tolerances import Tolerance
from dikbench.report.comparison.versions import same_machine, version_differences
from dikbench.results.reading import read_results


@dataclass(frozen=True, eq=False)
class Comparison:
    """What two results folders have in common and where they differ.

    Attributes:
        a, b: the folders.
        matched: their trials.
        formulations: see `formulation_differences`.
        times: see `time_ratios`.
        versions: see `version_differences`.
        same_machine: whether times can be compared at all.
        guarded: whether any tolerance was given.
    """

    a: Path
    b: Path
    matched: MatchedTrials
    formulations: pd.DataFrame
    times: pd.DataFrame
    versions: list[tuple[str, str, str]]
    same_machine: bool
    guarded: bool

    @property
    def beyond(self) -> int:
        """Number of metrics of trials that are beyond a tolerance."""
        return int(self.formulations["beyond"].sum()) if len(self.formulations) else 0

    @property
    def regressed(self) -> bool:
        """Whether a tolerance is exceeded or, where one was given, a trial newly fails."""
        return self.guarded and (self.beyond > 0 or self.matched.newly_failed > 0)

    def trials(self) -> pd.DataFrame:
        """Every difference, trial by trial (see `trial_differences`)."""
        return trial_differences(self.matched)


def compare(a: Path, b: Path, tolerances: Sequence[Tolerance] = ()) -> Comparison:
    """Compare two results folders.

    Raises:
        DikbenchError: if one of them holds no results, they have nothing in common, or a tolerance
            is on a metric that one of them lacks.
    """
    of_a, of_b = read_results(a), read_results(b)
    matched = match_trials(of_a.trials, of_b.trials, (str(a), str(b)))
    return Comparison(
        a,
        b,
        matched,
        formulation_differences(matched, tolerances),
        time_ratios(matched),
        version_differences(of_a.manifest, of_b.manifest),
        same_machine(of_a.manifest, of_b.manifest),
        bool(tolerances),
    )
