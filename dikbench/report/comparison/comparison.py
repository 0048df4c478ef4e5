"""A comparison of two results folders, from reading them to the verdict."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import pandas as pd

from dikbench.report.comparison.differences import law_differences, trial_differences
from dikbench.report.comparison.matching import MatchedTrials, match_trials
from dikbench.report.comparison.times import time_ratios
from dikbench.report.comparison.tolerances import Tolerance
from dikbench.report.comparison.versions import same_machine, version_differences
from dikbench.results.folder import ResultsFolder


@dataclass(frozen=True, eq=False)
class Comparison:
    """What two results folders have in common and where they differ.

    Attributes:
        a, b: the folders.
        matched: their trials.
        laws: see `law_differences`.
        times: see `time_ratios`.
        versions: see `version_differences`.
        same_machine: whether times can be compared at all.
        guarded: whether any tolerance was given.
    """

    a: Path
    b: Path
    matched: MatchedTrials
    laws: pd.DataFrame
    times: pd.DataFrame
    versions: list[tuple[str, str, str]]
    same_machine: bool
    guarded: bool

    @property
    def beyond(self) -> int:
        """Number of metrics of trials that are beyond a tolerance."""
        return int(self.laws["beyond"].sum()) if len(self.laws) else 0

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
    (trials_a, manifest_a), (trials_b, manifest_b) = (ResultsFolder(p).read() for p in (a, b))
    matched = match_trials(trials_a, trials_b, (str(a), str(b)))
    return Comparison(
        a,
        b,
        matched,
        law_differences(matched, tolerances),
        time_ratios(matched),
        version_differences(manifest_a, manifest_b),
        same_machine(manifest_a, manifest_b),
        bool(tolerances),
    )
