"""The sentences of a summary, each from the rows that carry it."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Final

import pandas as pd

from dikbench.metrics import VIOLATION_TOLERANCE
from dikbench.report.sentences.paired_wins import SAME, Lead, lead
from dikbench.report.sentences.words import (
    Contender,
    Names,
    degrees,
    listed,
    millimetres,
    number,
    several,
)
from dikbench.statistics.failures import has_failed, ran
from dikbench.statistics.stability import LARGEST_DRIFT_SHARE as DRIFT
from dikbench.statistics.stability import STABLE
from dikbench.statistics.trial_matrix import CONTENDER

ON_COURSE: Final = math.radians(1.0)
"""A formulation that is never farther off course than this stays on it."""

KEPT: Final = {
    "position_violation_max_rad": VIOLATION_TOLERANCE,
    "velocity_violation_max_rad_s": VIOLATION_TOLERANCE,
    "acceleration_violation_max_rad_s2": 1e3 * VIOLATION_TOLERANCE,
    "distance_violation_max_m": VIOLATION_TOLERANCE,
    "torque_violating_share": 0.0,
}
"""Limits that are passed by no more than this are kept: a solver's tolerance; that of velocities,
over a control period of 1 ms, is the one of accelerations; of distances, what is not linear in a
step. Limits of torques have their tolerance in the metric."""

TRUSTED: Final = 0.01
"""Formulations whose solver's answers fail the recheck in more than this share of a run's steps
lead in nothing: a wrong answer can look better than the right one."""

NOBODY: Final = "No formulation in this run"
ALL_ANSWERED: Final = "No trial failed and every step was answered."


@dataclass(frozen=True)
class Finding:
    """A sentence and what it answers.

    Attributes:
        question: in a few words.
        text: the sentence; names of formulations stand between backticks.
    """

    question: str
    text: str


def candidates(rows: pd.DataFrame) -> list[Contender]:
    """The laws that ran every trial of the rows without failing, with answers that can be trusted.

    Args:
        rows: trials of one plant and one reference mode.
    """
    trials = len(rows[["scenario", "seed"]].drop_duplicates())
    groups = rows.groupby(CONTENDER, sort=False)
    whole = (
        rows.assign(ok=rows["status"].eq("ok")).groupby(CONTENDER, sort=False)["ok"].sum() == trials
    )
    trusted = groups["not_verified_share"].max().fillna(0.0) <= TRUSTED
    return list(whole[whole & trusted].index)


def keepers(rows: pd.DataFrame) -> list[Contender]:
    """The candidates that keep every limit that is in force, in every trial."""
    worst = rows.groupby(CONTENDER, sort=False)[list(KEPT)].max().fillna(0.0)  # not in force: kept
    kept = (worst <= pd.Series(KEPT)).all(axis=1)
    return [contender for contender in candidates(rows) if kept[contender]]


def most_accurate(rows: pd.DataFrame, names: Names) -> Finding:
    """Who follows the target most closely, whatever it takes."""
    question = "Most accurate"
    found = _closest(rows, candidates(rows))
    if found is None:
        return Finding(question, f"{NOBODY} went through all trials with answers to be trusted.")
    leader, measure = found
    text = _accuracy(leader, measure, names)
    keeping = set(leader.contenders) & set(keepers(rows))
    if keeping == set(leader.contenders):
        text += ". Every limit is kept"
    elif not keeping:
        peaks = rows.groupby(CONTENDER)["velocity_peak_ratio"].max()
        peak = max(peaks[contender] for contender in leader.contenders)
        text += ". The limits are not kept"
        text += f": joint speeds reach {number(peak)} times their limit" if peak > 1 else ""
    return Finding(question, f"{text}.")


def most_accurate_within_limits(rows: pd.DataFrame, names: Names) -> Finding:
    """Who follows the target most closely of those that keep every limit."""
    question = "Most accurate within the limits"
    found = _closest(rows, keepers(rows))
    if found is None:
        return Finding(question, f"{NOBODY} keeps every limit here.")
    if _closest(rows, candidates(rows)) == found:
        return Finding(question, "The same.")
    return Finding(question, f"{_accuracy(*found, names)}.")


def keep_limits(rows: pd.DataFrame, names: Names) -> Finding:
    """Who keeps every limit."""
    contenders, every = keepers(rows), rows[CONTENDER].drop_duplicates()
    question = "Keeps every limit"
    if contenders:
        return Finding(
            question,
            f"{names.of(contenders)}: {len(contenders)} of {len(every)} formulations "
            f"with their solvers, in "
            f"{_every_trial(rows)}.",
        )
    return Finding(question, f"{NOBODY} keeps every limit in {_every_trial(rows)}.")


def stay_on_course(rows: pd.DataFrame, names: Names) -> Finding:
    """Who slows down rather than leave the wanted direction, and who of them gets on best."""
    question = "Stays on course"
    worst = rows.groupby(CONTENDER, sort=False)["direction_error_max_rad"].max()
    whole = [contender for contender in candidates(rows) if not math.isnan(worst[contender])]
    if not whole:
        return Finding(question, f"{NOBODY} went through all trials with answers to be trusted.")
    staying = [contender for contender in whole if worst[contender] <= ON_COURSE]
    if not staying:
        least = min(whole, key=lambda contender: float(worst[contender]))
        return Finding(
            question,
            f"{NOBODY} stays within {degrees(ON_COURSE)} of the wanted direction; "
            f"nearest to it {names.of([least])}, at most {degrees(worst[least])} off.",
        )
    text = f"{names.of(staying)}: never more than {degrees(ON_COURSE)} off the wanted direction"
    keeping = [contender for contender in keepers(rows) if contender in set(staying)]
    leader = lead(rows.assign(slowness=-rows["progress_mean"]), "slowness", keeping)
    if leader is None:
        return Finding(question, f"{text}, but none of them keeps every limit.")
    speed = f"at {number(-100 * leader.value)} % of the wanted speed (median)"
    if leader.runner_up is not None:
        best = f"{names.of(leader.contenders)} get{'s' * (len(leader.contenders) == 1)} on best"
    else:
        best = names.of(keeping) + (" get on alike" if len(keeping) > 1 else " alone gets on")
        if len(keeping) == len(staying) > 1:
            best = "they get on alike"
    return Finding(question, f"{text}. Within the limits {best}, {speed}.")


def fail_most(rows: pd.DataFrame, names: Names) -> Finding:
    """Who fails most: by trials that broke off, else by steps that a law had no answer for."""
    question = "Fails most"
    rows = ran(rows)
    if rows.empty:
        return Finding(question, "No trial was run.")
    failed = rows[has_failed(rows)]
    if len(failed):
        counts = failed.groupby(CONTENDER, sort=False).size()
        shares = counts / rows.groupby(CONTENDER, sort=False).size()[counts.index]
        most = _largest(shares)
        by_status = failed.set_index(CONTENDER).loc[most]["status"].value_counts()
        reasons = listed([f"{number} {status}" for status, number in by_status.items()])
        each = " each" if len(most) > 1 else ""
        return Finding(
            question,
            f"{names.of(most)}: {number(100 * shares.max())} % of the trials{each} "
            f"({several(int(counts[most].sum()), 'trial')}: {reasons}).",
        )
    of_a_run = rows[["infeasible_share", "solver_failed_share"]].sum(axis=1)
    unanswered = rows.assign(unanswered=of_a_run).groupby(CONTENDER, sort=False)["unanswered"].max()
    worst = float(unanswered.max())
    if worst <= 0:
        return Finding(question, ALL_ANSWERED)
    most = _largest(unanswered)
    slowed = "was" if len(most) == 1 else "were"
    return Finding(
        question,
        f"No trial failed; {names.of(most)} had no answer in up to {number(100 * worst)} % of a "
        f"run's steps, and {slowed} slowed down.",
    )


def _largest(shares: pd.Series) -> list[Contender]:
    """Those with the largest share, which is not zero, and those whose share is the same."""
    return list(shares[shares >= (1 - SAME) * shares.max()].index)


def fastest(rows: pd.DataFrame, within_limits: Sequence[Contender], names: Names) -> Finding:
    """Whose call takes the least time, of all formulations and of those that keep every limit.

    Args:
        rows: trials, of any plant.
        within_limits: the formulations that keep every limit.
        names: how they are called.
    """
    question = "Fastest"
    cells = rows.drop_duplicates([*CONTENDER, "scenario"])
    cells = cells[cells["formulation_time_median_us"].notna()]
    if cells.empty:
        return Finding(question, "No times were taken.")
    timed = cells.groupby(CONTENDER, sort=False)["scenario"].nunique()
    medians = cells.groupby(CONTENDER, sort=False)["formulation_time_median_us"].median()
    medians = medians[timed.eq(timed.max())].sort_values(kind="stable")
    parts = [_quickest(medians, names)]
    keeping = medians[[contender for contender in medians.index if contender in set(within_limits)]]
    if len(keeping) and not set(keeping.index[:1]) <= set(_alike(medians)):
        parts.append("of those that keep every limit " + _quickest(keeping, names))
    if len(medians) > 1:
        parts.append(
            f"the slowest, {names.of([medians.index[-1]])}, takes "
            f"{number(medians.iloc[-1] / medians.iloc[0])} times as long"
        )
    text = f"{'; '.join(parts)} (medians over {several(int(timed.max()), 'scenario')})."
    unstable = int(cells["timing_stability"].ne(STABLE).sum())
    if unstable:
        text += f" Of {len(cells)} timed cells {unstable} are not stable."
    return Finding(question, text)


def _quickest(medians: pd.Series, names: Names) -> str:
    alike = _alike(medians)
    if len(alike) == 1:
        return f"{names.of(alike)} takes {number(medians.iloc[0])} us a call"
    return (
        f"{names.of(alike)} take {number(medians.iloc[0])} to {number(medians[alike].max())} "
        f"us a call, which is not told apart (a stable time may drift by {number(100 * DRIFT)} %)"
    )


def _alike(medians: pd.Series) -> list[Contender]:
    """Those whose times are no farther from the shortest than a stable time may drift."""
    return list(medians[medians <= (1 + DRIFT) * medians.iloc[0]].index)


def _closest(
    rows: pd.DataFrame, contenders: Sequence[Contender]
) -> tuple[Lead, Callable[[float], str]] | None:
    """Who leads in the position error, or in that of the orientation where there is no other."""
    for metric, measure in (
        ("position_error_rms_m", millimetres),
        ("orientation_error_rms_rad", degrees),
    ):
        leader = lead(rows, metric, contenders)
        if leader is not None:
            return leader, measure
    return None


def _accuracy(leader: Lead, measure: Callable[[float], str], names: Names) -> str:
    one = leader.trials == 1
    rms = "rms" if one else f"rms, median over {leader.trials} trials"
    together = ", not told apart," if len(leader.contenders) > 1 else ""
    text = f"{names.of(leader.contenders)}{together} with {measure(leader.value)} ({rms})"
    if leader.runner_up is None:
        return text
    behind = "" if one else f", behind in {leader.wins} of {leader.trials}"
    return (
        f"{text}; next is {names.of([leader.runner_up])} with {measure(leader.runner_up_value)}"
        f"{behind}"
    )


def _every_trial(rows: pd.DataFrame) -> str:
    trials = len(rows[["scenario", "seed"]].drop_duplicates())
    return "the only trial" if trials == 1 else f"all {trials} trials"
