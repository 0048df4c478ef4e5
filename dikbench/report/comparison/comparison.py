"""A comparison of two results folders, from reading them to what became worse."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import pandas as pd

from dikbench.report.comparison.differences import formulation_differences, trial_differences
from dikbench.report.comparison.gate import breaches
from dikbench.report.comparison.matching import Best, MatchedTrials, match_trials
from dikbench.report.comparison.success_changes import success_changes
from dikbench.report.comparison.times import COMPARED, time_ratios
from dikbench.report.comparison.tolerances import SUCCESS, Tolerance
from dikbench.report.comparison.versions import same_machine, version_differences
from dikbench.results.reading import metrics_described, read_results, without_attributes


@dataclass(frozen=True, eq=False)
class Comparison:
    """What two results folders have in common and where they differ.

    Attributes:
        a, b: the folders.
        matched: their trials.
        formulations: see `formulation_differences`.
        success: see `success_changes`.
        times: see `time_ratios`.
        versions: see `version_differences`.
        same_machine: whether times can be compared at all.
        guarded: whether any tolerance was given.
        breaches: see `breaches`.
    """

    a: Path
    b: Path
    matched: MatchedTrials
    formulations: pd.DataFrame
    success: pd.DataFrame
    times: pd.DataFrame
    versions: list[tuple[str, str, str]]
    same_machine: bool
    guarded: bool
    breaches: tuple[str, ...]

    @property
    def regressed(self) -> bool:
        """Whether B is worse than the tolerances allow."""
        return bool(self.breaches)

    @property
    def nothing_differs(self) -> bool:
        """Whether both have the same trials, with the same statuses, outcomes and metrics."""
        matched = self.matched
        alone = len(matched.only_a) + len(matched.only_b)
        moved = self.success[["lost", "gained"]].to_numpy().sum() if len(self.success) else 0
        return not alone and matched.status_changes.empty and self.formulations.empty and not moved

    def trials(self) -> pd.DataFrame:
        """Every difference, trial by trial (see `trial_differences`)."""
        return trial_differences(self.matched)


def compare(a: Path, b: Path, tolerances: Sequence[Tolerance] = ()) -> Comparison:
    """Compare two results folders.

    Raises:
        DikbenchError: if one of them holds no results, they have nothing in common, or a tolerance
            is on a metric that one of them lacks.
    """
    of_a, of_b = (without_attributes(read_results(folder)) for folder in (a, b))
    others = _in_both(of_a.manifest, of_b.manifest)
    matched = match_trials(of_a.trials, of_b.trials, (str(a), str(b)), others)
    on_metrics = [each for each in tolerances if each.metric not in (SUCCESS, *COMPARED)]
    formulations = formulation_differences(matched, on_metrics)
    success, times = success_changes(matched), time_ratios(matched)
    return Comparison(
        a,
        b,
        matched,
        formulations,
        success,
        times,
        version_differences(of_a.manifest, of_b.manifest),
        same_machine(of_a.manifest, of_b.manifest),
        bool(tolerances),
        breaches(matched, formulations, success, times, tolerances),
    )


def _in_both(a: Mapping[str, Any], b: Mapping[str, Any]) -> dict[str, Best]:
    """Return the metrics of other authors that both manifests describe alike, and what is best."""
    of_a, of_b = metrics_described(a), metrics_described(b)
    return {
        name: "low" if each.get("best") == "low" else "high"
        for name, each in of_a.items()
        if name in of_b and each.get("best") == of_b[name].get("best")
    }
