"""The gate: whether B may pass, and what speaks against it, most serious first."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from typing import Any, Final

import pandas as pd

from dikbench.errors import DikbenchError
from dikbench.report.comparison.matching import MatchedTrials
from dikbench.report.comparison.times import COMPARED, RATIOS, untimed
from dikbench.report.comparison.tolerances import SUCCESS, Tolerance
from dikbench.report.sentences.words import several

ROUNDING: Final = 1e-9
"""A fall of the rate of success below this comes from adding in another order."""

SOLVER_FAILED: Final = "solver_failed_share"

TOLD: Final = 3
"""So many formulations of a kind are told in the first line."""


def breaches(
    matched: MatchedTrials,
    formulations: pd.DataFrame,
    success: pd.DataFrame,
    times: pd.DataFrame,
    tolerances: Sequence[Tolerance],
) -> tuple[str, ...]:
    """Say in a phrase each why B does not pass; nothing where it does, or where nothing is asked.

    With any tolerance given, no trial of A may be missing in B or newly fail, its solver may not
    newly fail (unless `solver_failed_share` has a tolerance of its own), and the success of no
    formulation may fall (unless `success` has one).

    Args:
        matched: the trials.
        formulations: see `formulation_differences`.
        success: see `success_changes`.
        times: see `time_ratios`.
        tolerances: what is allowed; empty: everything.

    Raises:
        DikbenchError: if a tolerance is on success or times that one of the folders lacks.
    """
    if not tolerances:
        return ()
    own = {tolerance.metric for tolerance in tolerances}
    found = []
    if number := matched.missing:
        found.append(f"{several(number, 'trial')} of A missing in B")
    if number := matched.newly_failed:
        found.append(f"{several(number, 'trial')} newly failed")
    if (number := int(matched.solver_newly_fails.sum())) and SOLVER_FAILED not in own:
        found.append(f"the solver newly fails in {several(number, 'trial')}")
    found += _falls(success, tolerances)
    beyond = int(formulations["beyond"].sum()) if len(formulations) else 0
    if beyond:
        found.append(f"{beyond} beyond tolerance")
    return (*found, *_slower(matched, times, tolerances))


def _falls(success: pd.DataFrame, tolerances: Sequence[Tolerance]) -> list[str]:
    """Phrase where the success of a formulation falls by more than its tolerance."""
    given = [tolerance.bound for tolerance in tolerances if tolerance.metric == SUCCESS]
    if success.empty:
        if given:
            raise DikbenchError(
                "tolerance on success: one of the folders has no outcomes; `dikbench recompute` "
                "adds them from traces"
            )
        return []
    allowed = min(given, default=0.0) + ROUNDING
    fallen = success[success["rate_a"] - success["rate_b"] > allowed]
    return _few(
        f"success of {named(row)} ({row['plant']} plant, {row['setting']}) fell from "
        f"{100 * row['rate_a']:.1f} to {100 * row['rate_b']:.1f} %"
        for row in fallen.loc[_worst_first(fallen["rate_a"] - fallen["rate_b"])].to_dict("records")
    )


def _slower(
    matched: MatchedTrials, times: pd.DataFrame, tolerances: Sequence[Tolerance]
) -> list[str]:
    """Phrase where a formulation takes longer than its tolerance, or has lost its times."""
    asked = [tolerance for tolerance in tolerances if tolerance.metric in COMPARED]
    if not asked:
        return []
    if times.empty:
        raise DikbenchError(
            f"tolerance on {asked[0].metric}: the folders have no times of the same cells; a "
            "study with a section [timing] takes them"
        )
    lost = untimed(matched)
    found = [f"{several(lost, 'timed cell')} of A without times in B"] if lost else []
    for tolerance in asked:
        ratio = times[RATIOS[tolerance.metric]]
        slower = times.loc[_worst_first(ratio[ratio > 1 + tolerance.bound])]
        found += _few(
            f"{named(row)} takes {row[RATIOS[tolerance.metric]]:.3g} times as long "
            f"({tolerance.metric})"
            for row in slower.to_dict("records")
        )
    return found


def _worst_first(amount: pd.Series) -> pd.Index:
    """Order rows by an amount, the largest first."""
    return amount.sort_values(ascending=False, kind="stable").index


def _few(phrases: Iterable[str]) -> list[str]:
    """Return the first phrases, and how many more there are."""
    told = list(phrases)
    left = len(told) - TOLD
    return told if left <= 0 else [*told[:TOLD], f"{left} more like it"]


def named(row: Mapping[Any, Any]) -> str:
    """Name a formulation with its solver, where it has one."""
    solver = row["solver"]
    return f"{row['formulation']}" + ("" if solver == "none" else f" with {solver}")
