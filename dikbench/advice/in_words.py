"""Advice in words: what was found of the arm, what is recommended, what it will not do."""

from __future__ import annotations

import shlex
from collections import Counter
from collections.abc import Sequence
from typing import Final

import pandas as pd

from dikbench.advice.advising import Advice, on_ideal_plant
from dikbench.advice.answering import Answer, Standing
from dikbench.advice.trying import DISTURBED
from dikbench.advice.worst_case import WorstCase
from dikbench.metrics import OUTCOME_SENTENCES, Outcome
from dikbench.report.sentences.words import number, several
from dikbench.statistics.success import DONE

MOST_NAMED: Final = 6
"""So many tied formulations are named, the others are counted."""


def answer_in_words(answer: Answer) -> str:
    """Say in a sentence or two what is recommended for a need, on what evidence."""
    first = answer.first
    if first is None:
        return f"to {answer.need}: nothing is recommended: {answer.reason}"
    text = f"to {answer.need}: {first.name}: {_failed(first)} {answer.need.failed}"
    if (
        answer.need.kind != "limits"
        and answer.need.setting == "path"
        and first.slowest == first.slowest
    ):
        text += f", the slowest in {first.slowest:.3g} times the nominal time"
    text += f" ({several(answer.cases, 'case')})"
    if answer.tied:
        some = ", ".join(f"{each.name} ({_failed(each)})" for each in answer.tied[:MOST_NAMED])
        more = len(answer.tied) - MOST_NAMED
        text += f"; not told apart from it by this sample: {some}"
        text += f" and {more} more" if more > 0 else ""
    if answer.left_behind:
        some = ", ".join(f"{each.name} ({_failed(each)})" for each in answer.left_behind)
        text += f"; left behind early, though not told apart by so few cases: {some}"
    if answer.runner_up is not None:
        up = answer.runner_up
        text += f"; {'next' if answer.tied else 'runner-up'}: {up.name} ({_failed(up)})"
    return text


def _failed(standing: Standing) -> str:
    return f"{standing.failed} of {several(standing.runs, 'run')}"


def will_not_do(advice: Advice) -> list[str]:
    """Say how what is recommended failed, by family and outcome, and with noise and delay."""
    chosen = advice.chosen
    if chosen is None:
        return []
    trials = advice.tries.trials
    own = trials[trials["formulation"].eq(chosen.formulation) & trials["solver"].eq(chosen.solver)]
    lines = []
    ideal = on_ideal_plant(own)
    for setting, words in (("path", "where the path may wait"), ("time", "by the clock")):
        rows = ideal[ideal["reference"].eq(setting) & ideal["outcome"].notna()]
        feasible = rows[rows["feasible"].isin(["time", "path"])]
        failed = feasible[~feasible["outcome"].isin(DONE)]
        pairs = Counter(zip(failed["scenario_family"], failed["outcome"], strict=True))
        named = [
            f"{count} of {feasible['scenario_family'].eq(family).sum()} in {family} ({outcome}: "
            f"{OUTCOME_SENTENCES[Outcome(outcome)]})"
            for (family, outcome), count in pairs.items()
        ]
        done = f"it did its job in {len(feasible) - len(failed)} of {several(len(feasible), 'run')}"
        lines.append(f"{words}, {done}" + (f"; it failed in {'; '.join(named)}" if named else ""))
    beyond = ideal[ideal["feasible"].isin(["no", "unknown"])]
    if len(beyond):
        lines.append(
            f"{several(len(beyond), 'run')} of cases of which nobody knows a motion that does them "
            "count nowhere"
        )
    disturbed = own[own["plant"].eq(str(DISTURBED)) & own["feasible"].isin(["time", "path"])]
    if len(disturbed):
        well = int(disturbed["outcome"].isin(DONE).sum())
        lines.append(
            f"by the clock, with noise of 1e-4 rad on the measured joints and commands 2 steps "
            f"late, it did its job in {well} of {several(len(disturbed), 'run')}"
        )
    return lines


def times_in_words(advice: Advice) -> list[str]:
    """Say how long a call takes, of how much there is."""
    lines = []
    for row in advice.times:
        if "formulation_time_p99_us" not in row:
            continue
        lines.append(
            f"a call of {row['formulation']}"
            + (f" with {row['solver']}" if row["solver"] != "none" else "")
            + f" takes {number(row['formulation_time_median_us'])} us in the median, "
            f"{number(row['formulation_time_p99_us'])} us at p99, of "
            f"{number(1e6 * advice.dt)} us ({row['timing_samples']} calls on this machine: "
            f"{row['timing_stability']})"
        )
    if lines:
        lines.append(
            "a call is the formulation with its solver; `solve_dik` checks all that it is given "
            "and computes the kinematics as well, which takes some 0.1 ms more, and with a program "
            "longer"
        )
    return lines


def whole(
    advice: Advice, worst: WorstCase | None, worst_lines: Sequence[str], again: str
) -> list[tuple[str, list[str]]]:
    """Make everything that the terminal and the page say, as headings with lines."""
    arm = advice.arm
    chapters = [("The arm", list(arm.facts))]
    if arm.assumed:
        chapters.append(("What is assumed", list(arm.assumed)))
    chapters.append(("What is recommended", [answer_in_words(each) for each in advice.answers]))
    if advice.chosen is not None:
        chapters.append((f"What {advice.chosen.name} will not do", will_not_do(advice)))
        if lines := times_in_words(advice):
            chapters.append(("What it costs", lines))
    if worst is not None:
        same = "" if worst.same else " (the numbers differ from those of the search)"
        chapters.append(
            (
                "The worst run that was found" + same,
                [
                    *(line.strip() for line in worst_lines),
                    f"to run it: {shlex.join(worst.command)}",
                    "to watch it: "
                    + shlex.join(
                        ["dikbench", "replay", *worst.ids, "--results", str(worst.folder)]
                    ),
                ],
            )
        )
    elif advice.no_search:
        chapters.append(("The worst run", [f"none was searched for: {advice.no_search}"]))
    if advice.phase is None and advice.no_phase:
        chapters.append(("Near misses", [f"no phase diagram: {advice.no_phase}"]))
    chapters.append(("The sample", _sample(advice, again)))
    return chapters


def _sample(advice: Advice, again: str) -> list[str]:
    """Say what was run."""
    tries = advice.tries
    families = pd.Series([scenario.name for scenario, _ in tries.cases]).value_counts(sort=False)
    counts = ", ".join(f"{name} {count}" for name, count in families.items())
    lines = [
        f"{several(len(tries.rows), 'trial')} of {several(len(tries.cases), 'case')} ({counts}); "
        f"on the first {tries.first_part} everything that was tried, on the others "
        f"{', '.join(str(each) for each in advice.went_on)}",
    ]
    lines += [f"no case of {family}: {why}" for family, why in advice.left_out.items()]
    lines.append(f"the same advice: {again}")
    return lines
