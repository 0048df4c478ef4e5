"""Which formulation for which situation, in sentences that the trials carry."""

from __future__ import annotations

from dataclasses import dataclass

import pandas as pd

from dikbench.report.selection.situations import READING_ORDER, Situation, situation_of
from dikbench.report.sentences.findings import (
    ALL_ANSWERED,
    Finding,
    fail_most,
    fastest,
    keep_limits,
    keepers,
    most_accurate,
    most_accurate_within_limits,
    stay_on_course,
)
from dikbench.report.sentences.words import Names, several
from dikbench.scenario.oracle import ORACLES


@dataclass(frozen=True)
class Chapter:
    """The findings in one situation.

    Attributes:
        situation: which.
        scenarios: selectors of its scenarios.
        findings: what is said of it.
    """

    situation: Situation
    scenarios: tuple[str, ...]
    findings: tuple[Finding, ...]


@dataclass(frozen=True)
class Summary:
    """What a person reads first.

    Attributes:
        basis: of which trials it speaks.
        short: findings over all situations.
        chapters: findings per situation.
    """

    basis: str
    short: tuple[Finding, ...] = ()
    chapters: tuple[Chapter, ...] = ()

    @property
    def scenarios(self) -> int:
        """How many scenarios it speaks of."""
        return sum(len(chapter.scenarios) for chapter in self.chapters)


def summarise(trials: pd.DataFrame) -> Summary:
    """Say which formulation is for which situation.

    Plants and reference modes are never pooled: the ideal plant is spoken of, on which violations
    show, and the clock as reference, where they were run.

    Args:
        trials: the rows of trials.csv.
    """
    contenders = trials[~trials["formulation"].isin(ORACLES) & trials["status"].ne("skipped")]
    if contenders.empty:
        return Summary("No formulation was run.")
    plant = _first(contenders["plant"], "ideal")
    rows = contenders[contenders["plant"].eq(plant)]
    reference = _first(rows["reference"], "time")
    rows = rows[rows["reference"].eq(reference)]
    names = Names(contenders)
    seed = int(rows["seed"].min())
    kinds = {scenario: situation_of(scenario, seed) for scenario in rows["scenario"].unique()}
    chapters = []
    for situation in READING_ORDER:
        scenarios = tuple(scenario for scenario, kind in kinds.items() if kind is situation)
        if scenarios:
            findings = _findings(rows[rows["scenario"].isin(scenarios)], names)
            chapters.append(Chapter(situation, scenarios, findings))
    clock = reference == "time"
    basis = (
        f"These sentences are about the {plant} plant with a reference that moves on with "
        f"{'the clock' if clock else 'the progress achieved'}: {several(len(kinds), 'scenario')}, "
        f"{several(rows['seed'].nunique(), 'seed')}. A law leads only where it ran all trials "
        "without failing and the answers of its solver passed the recheck."
    )
    short = (
        keep_limits(rows, names),
        stay_on_course(rows, names),
        fastest(contenders, keepers(rows), names),
        fail_most(contenders, names),
    )
    return Summary(basis, short, tuple(chapters))


def _first(values: pd.Series, wanted: str) -> str:
    """The wanted value where it occurs, else the first."""
    return wanted if values.eq(wanted).any() else str(values.iloc[0])


def _findings(rows: pd.DataFrame, names: Names) -> tuple[Finding, ...]:
    found = (
        most_accurate(rows, names),
        most_accurate_within_limits(rows, names),
        keep_limits(rows, names),
        stay_on_course(rows, names),
        fail_most(rows, names),
    )
    return tuple(finding for finding in found if finding.text != ALL_ANSWERED)
