"""Which formulation for which situation, in sentences that the trials carry."""

from __future__ import annotations

from dataclasses import dataclass

import pandas as pd

from dikbench.report.selection.judged import (
    DEFINITIONS,
    SETTINGS,
    judged_plant,
    judged_rows,
    rows_of_all,
)
from dikbench.report.sentences.findings import (
    Finding,
    broke_off,
    fastest,
    first_most_often,
    leaders,
    most_accurate,
    unanswered,
)
from dikbench.report.sentences.headline import headline
from dikbench.report.sentences.robustness import hangs_on_conventions
from dikbench.report.sentences.words import Names, several
from dikbench.scenario.oracle import ORACLES
from dikbench.scenario.situation import Situation
from dikbench.statistics.first_places import (
    FEWEST_SCENARIOS,
    MOST_BROKEN_SHARE,
    SMALLEST_SHARE_OF_BEST,
    dependable,
    held_back,
)
from dikbench.statistics.success import MOST_BEHIND, Contender, Setting, with_facts
from dikbench.statistics.trial_matrix import CASE


@dataclass(frozen=True)
class Chapter:
    """The findings in one situation.

    Attributes:
        situation: which.
        definition: what holds in it.
        scenarios: selectors of its scenarios.
        findings: what is said of it.
    """

    situation: Situation
    definition: str
    scenarios: tuple[str, ...]
    findings: tuple[Finding, ...]


@dataclass(frozen=True)
class Summary:
    """What a person reads first.

    Attributes:
        basis: of which trials it speaks.
        short: findings over all situations.
        chapters: findings per situation, where there are any.
        scenarios: how many scenarios it speaks of.
        headlines: for the situations in which somebody can be named, who succeeds most, in a line.
    """

    basis: str
    short: tuple[Finding, ...] = ()
    chapters: tuple[Chapter, ...] = ()
    scenarios: int = 0
    headlines: tuple[str, ...] = ()


def summarise(trials: pd.DataFrame) -> Summary:
    """Say which formulation is for which situation.

    Args:
        trials: the rows of trials.csv.
    """
    contenders = trials[~trials["formulation"].isin(ORACLES) & trials["status"].ne("skipped")]
    if contenders.empty:
        return Summary("No formulation was run.")
    if trials["feasible"].fillna("").eq("").all():
        return Summary(
            "These results are without outcomes, as an older version wrote them, so that nothing "
            "is concluded from them; `dikbench recompute` adds outcomes where traces were kept."
        )
    names = Names(contenders)
    of_setting = {setting: judged_rows(trials, setting) for setting in SETTINGS}
    every = rows_of_all(of_setting)
    candidates = {setting: dependable(rows, every) for setting, rows in of_setting.items()}
    barred = {setting: held_back(rows, every) for setting, rows in of_setting.items()}
    chapters: list[Chapter] = []
    headlines: list[str] = []
    firsts: list[tuple[Setting, tuple[Contender, ...]]] = []
    for situation, definition in DEFINITIONS.items():
        findings: list[Finding] = []
        scenarios: dict[str, None] = {}
        for setting, rows in of_setting.items():
            part = rows[rows["situation"].eq(situation)]
            scenarios |= dict.fromkeys(part["scenario"].unique())
            if part.empty:
                continue
            leading = leaders(part, setting, candidates[setting], names, barred[setting])
            if leading is None:
                continue
            if leading.alone:
                firsts.append((setting, leading.contenders))
            findings.append(leading.finding)
            line = headline(leading, setting, len(part[list(CASE)].drop_duplicates()), names)
            if line and not any(each.startswith(situation) for each in headlines):
                headlines.append(f"{situation}, {line}")
            if setting == "path" and (closest := most_accurate(part, leading, names)):
                findings.append(closest)
        if findings:
            chapters.append(Chapter(situation, definition, tuple(scenarios), tuple(findings)))
    among = set().union(*candidates.values())
    conventions = hangs_on_conventions(of_setting)
    short = (
        *first_most_often(firsts, names),
        fastest(contenders, among, names),
        broke_off(contenders, names),
        unanswered(every[~every["formulation"].isin(ORACLES)], names),
        Finding("The order and conventions", conventions) if conventions else None,
    )
    said = tuple(each for each in short if each)
    return Summary(
        _basis(trials), said, tuple(chapters), every["scenario"].nunique(), tuple(headlines)
    )


def _basis(trials: pd.DataFrame) -> str:
    """Say of which trials the summary speaks."""
    plant = judged_plant(trials)
    cases = with_facts(trials[trials["plant"].eq(plant)]).drop_duplicates(["scenario", "seed"])
    known = int(cases["feasible"].isin(["time", "path"]).sum())
    return (
        f"Success on the {plant} plant in the {known} of {several(len(cases), 'case')} (a scenario "
        "with a seed) that a known motion can do. Who is stopped by a limit that it is told of, by "
        f"a collision or a failure in more than {100 * MOST_BROKEN_SHARE:g} % of them, or succeeds "
        f"overall in at most {100 * SMALLEST_SHARE_OF_BEST:g} % of what the best of the others "
        "does, is no candidate, however well it does in a situation (see the table of success). "
        f"First is who is at most {100 * MOST_BEHIND:g} points behind the best candidate, cannot "
        "be told apart from it (95 % paired intervals) and is not slower than another of them, "
        "where every other candidate can be told apart; where one cannot, they all may be first. "
        f"Nobody is named where fewer than {FEWEST_SCENARIOS} scenarios count."
    )
