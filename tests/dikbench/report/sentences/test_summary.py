"""The summary of a whole study: every number recomputed."""

from __future__ import annotations

import re
from collections import Counter
from math import inf
from pathlib import Path
from statistics import median

import pandas as pd
import pytest
from makers import recomputed
from makers.made_up import made_up_study
from makers.recomputed import Row, case, contender
from makers.rows import make_rows

from dikbench.report.conclusions import conclusions
from dikbench.report.sentences.summary import Summary, summarise
from dikbench.report.sentences.words import number
from dikbench.report.tables.success import success_table
from dikbench.results.reading import read_results, without_attributes
from dikbench.results.selected import with_selected

SETTINGS = {"the path may wait": "path", "the clock does not wait": "time"}


@pytest.fixture(scope="module", params=["a real run", "made-up trials"])
def told(
    request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory
) -> tuple[Summary, pd.DataFrame, list[Row]]:
    """A summary, the rows that it is of, and the same rows as texts."""
    if request.param == "a real run":
        folder: Path = request.getfixturevalue("results")
        rows = without_attributes(read_results(folder, lenient=True)).trials
    else:
        folder = tmp_path_factory.mktemp("summary")
        made_up_study().to_csv(folder / "trials.csv", index=False)
        rows = with_selected(made_up_study())
    return summarise(rows), rows, recomputed.read(folder / "trials.csv")


def _solver_of(names: str, groups: dict[recomputed.Contender, list[Row]]) -> list[tuple[str, str]]:
    """Every formulation that a list of names is of, with each of its solvers that is named."""
    found = []
    for name, _, solvers in re.findall(r"`([^`]+)`( \(([^)]*)\))?", names):
        every = [pair for pair in groups if pair[0] == name]
        listed = re.findall(r"`([^`]+)`", solvers)
        if "but" in solvers:
            found += [pair for pair in every if pair[1] not in listed]
        else:
            found += [pair for pair in every if not listed or pair[1] in listed]
    return found


def test_rates_and_samples_are_those_of_the_rows(
    told: tuple[Summary, pd.DataFrame, list[Row]],
) -> None:
    """Cases, scenarios, robots, every rate, the points of who is next, the durations."""
    summary, rows, trials = told
    table, checked = success_table(rows), 0
    for chapter in summary.chapters:
        for finding in chapter.findings:
            where = next((s for s in SETTINGS if finding.question.endswith(s)), "")
            if not where:
                continue
            counted = recomputed.that_count(trials, SETTINGS[where])
            part = [row for row in counted if row["situation"] == chapter.situation]
            groups = recomputed.by_contender(part)
            head, said = finding.text.split(": ", 1)
            _check_sample(head, part)
            said, _, pace = said.partition(". Median time over the ")
            said = said.removesuffix(".")
            block = next(b for b in table.blocks if b.reference == SETTINGS[where])
            place = [column.heading for column in table.columns].index(chapter.situation)
            cells = {(row.formulation, row.solver): row.cells[place] for row in block.rows}
            first = {name for name, cell in cells.items() if cell.best and not cell.text}
            unseen = {contender(row) for row in part if row["sees_constraints"] == "0.0"}
            may_be = recomputed.may_be_first(trials, SETTINGS[where]) & recomputed.whole(part)
            may_be -= unseen
            tied = {name for name in may_be if cells[name].upper >= 0}
            said, also = _split_off(said, "; as successful, but no candidate (stopped in ")
            if finding.question.startswith("Nobody stands out"):
                assert not also
            else:
                checked += _check_barred(also, trials, SETTINGS[where], part, first, unseen)
            if "candidates have" in said and not finding.question.startswith("Too few cases"):
                rates = [100 * recomputed.rate(groups[name]) for name in first]
                low, high = number(min(rates)), number(max(rates))
                assert first == may_be
                assert finding.question.startswith("Nobody stands out")
                assert f"all {len(first)} candidates have " in said
                assert (f"{low} to {high} %" if low != high else f"have {high} %") in said
                checked += 2
            if finding.question.startswith("Too few cases"):
                rates = [100 * recomputed.rate(groups[name]) for name in may_be]
                low, high = number(min(rates)), number(max(rates))
                assert said.endswith(f"have {low} to {high} %" if low != high else f"have {low} %")
                assert len({row["scenario"] for row in part}) < 5
                assert not first
                checked += 2
            named, slower = [], []
            said, slow = _split_off(said, "; slower: ")
            for names, _ in re.findall(r"([^;]*?) with ([\d.e+-]+) %", slow.split("; next of")[0]):
                slower += _solver_of(names, groups)
            said = f"{said}; {slow}" if slow else said
            for names, share in re.findall(r"([^;]*?) with ([\d.e+-]+) %", said):
                who = _solver_of(names, groups)
                for name in who:
                    assert number(100 * recomputed.rate(groups[name])) == share, finding
                    checked += 1
                if "next of the candidates is" in names:
                    low = number(-max(cells[name].upper for name in who))
                    high = number(-min(cells[name].lower for name in who))
                    points = low if low == high else f"{low} to {high}"
                    assert f"{share} %, {points} points less" in said
                else:
                    named += [name for name in who if name not in slower]
            if named and " more" not in said:
                assert first <= set(named)
                assert {*named, *slower} == tied
                assert finding.question.startswith("First") == (set(named) == first != may_be)
                assert finding.question.startswith("The only candidate") == (len(may_be) == 1)
            checked += _check_pace(pace, groups, set(named) or first)
    assert checked >= 2


def _split_off(text: str, words: str) -> tuple[str, str]:
    before, _, after = text.partition(words)
    return before, after


def _check_sample(head: str, part: list[Row]) -> None:
    """Cases, scenarios, robots, how many scenarios each has, and who has most of the cases."""
    cases = {case(row): row["robot"] for row in part}
    scenarios = {row["scenario"]: row["robot"] for row in part}
    robots = Counter(scenarios.values())
    assert f"success of {len(cases)} case" in head
    assert f"({len(scenarios)} scenario" in head
    most, of = Counter(cases.values()).most_common(1)[0]
    if len(robots) == 1:
        assert head.endswith(f" of one robot, {most})")
        return
    assert f" of {len(robots)} robots, " in head
    for robot, count in robots.items():
        assert f"{robot} {count}" in head
    assert (f"; {most} has {of} of the cases)" in head) == (of > len(cases) / 2)


def _check_barred(
    said: str,
    trials: list[Row],
    setting: str,
    part: list[Row],
    first: set[recomputed.Contender],
    unseen: set[recomputed.Contender],
) -> int:
    """Who is stopped in 5 to 25 % of all trials and succeeds as often here as the best: all."""
    groups = recomputed.by_contender(part)
    best = max((recomputed.rate(groups[name]) for name in first), default=inf)
    shares = recomputed.successful(trials, setting)
    expected = {
        name
        for name in recomputed.whole(part) - unseen
        if 0.05 < shares.get(name, 1.0) <= 0.25 and recomputed.rate(groups[name]) >= best - 1e-9
    }
    assert bool(expected) == bool(said)
    if not expected:
        return 0
    ends = dict.fromkeys(number(100 * end(shares[n] for n in expected)) for end in (min, max))
    much, names = said.split(" % of all trials): ")
    assert much == " to ".join(ends)
    assert set(_solver_of(names, groups)) == expected or " more" in names
    return 1


def _check_pace(
    said: str, groups: dict[recomputed.Contender, list[Row]], who: set[recomputed.Contender]
) -> int:
    """Medians over the cases that all of them did, of five scenarios at least."""
    if not said:
        return 0
    durations: dict[recomputed.Contender, dict[tuple[str, str], float]] = {
        name: {
            case(row): recomputed.number(row["slow_down"])
            for row in groups[name]
            if row["outcome"] in recomputed.DONE and row["slow_down"]
        }
        for name in who
    }
    common = set.intersection(*(set(of) for of in durations.values()))
    assert len({scenario for scenario, _ in common}) >= 5
    count, times = said.split(" did: ")
    assert int(count.split()[0]) == len(common)
    medians = [median(of[key] for key in common) for of in durations.values()]
    said_times = [float(n) for n in re.findall(r"\d[\d.]*", times)] or [1.0]
    assert {number(value) for value in said_times} == {number(min(medians)), number(max(medians))}
    return 1


def test_distances_are_those_of_the_rows(told: tuple[Summary, pd.DataFrame, list[Row]]) -> None:
    """Geometric means over the cases that all of the first did, and the ratio of who is next."""
    summary, rows, trials = told
    table = success_table(rows)
    for chapter in summary.chapters:
        for finding in chapter.findings:
            if finding.question != "Most accurate":
                continue
            counted = recomputed.that_count(trials, "path")
            part = [row for row in counted if row["situation"] == chapter.situation]
            groups = recomputed.by_contender(part)
            [leading] = [f for f in chapter.findings if "path may wait" in f.question]
            block = next(b for b in table.blocks if b.reference == "path")
            place = [column.heading for column in table.columns].index(chapter.situation)
            first = {(r.formulation, r.solver) for r in block.rows if r.cells[place].best}
            if leading.question.startswith("May be first"):
                before = leading.text.split(": ", 1)[1].partition("; next of")[0]
                first = set(_solver_of(before.partition("; as successful, but")[0], groups))
            away: dict[recomputed.Contender, dict[tuple[str, str], float]] = {}
            for row in part:
                good = row["outcome"] in recomputed.DONE and float(row["judged_by_path"] or 0) == 1
                if contender(row) in first and good:
                    of = away.setdefault(contender(row), {})
                    of[case(row)] = max(float(row["contour_error_6d_max_m"]), 1e-5)
            common = set.intersection(*(set(of) for of in away.values()))
            assert f"over the {len(common)} cases that all of them did" in finding.text
            near, after = finding.text.split("next is ")
            names = _solver_of(near, groups)
            means = [
                1e3 * recomputed.geometric({key: away[name][key] for key in common}, part)
                for name in names
            ]
            [millimetres] = re.findall(r"([\d.e-]+)(?: to ([\d.e-]+))? mm", near)
            if "more" not in near:
                said = {text for text in millimetres if text}
                assert said == {number(min(means)), number(max(means))}
            [second] = _solver_of(after.split(",")[0], groups)
            ratios = {
                name: recomputed.geometric(
                    {key: away[second][key] / away[name][key] for key in common}, part
                )
                for name in away
            }
            assert number(max(ratios.values())) == after.split(", ")[1].split()[0]
            nearest = max(ratios, key=lambda name: ratios[name])
            apart = {key[0] for key in common if abs(away[second][key] - away[nearest][key]) > 1e-5}
            assert f"in {len(apart)} scenarios of which" in finding.text
            assert len(apart) >= 5


def test_scenarios_and_cases_of_the_basis(
    told: tuple[Summary, pd.DataFrame, list[Row]],
) -> None:
    """How many cases there are on the ideal plant, and of how many a motion is known."""
    summary, _, trials = told
    facts = [row for row in recomputed.with_facts(trials) if row["plant"] == "ideal"]
    cases = {case(row): row["feasible"] for row in facts}
    known = sum(feasible in ("time", "path") for feasible in cases.values())
    assert f"in the {known} of {len(cases)} cases" in summary.basis
    counted = [*recomputed.that_count(trials, "time"), *recomputed.that_count(trials, "path")]
    assert summary.scenarios == len({row["scenario"] for row in counted})


def test_a_chapter_has_something_to_say(told: tuple[Summary, pd.DataFrame, list[Row]]) -> None:
    """No heading without a sentence, and no sentence without a name or a number."""
    for chapter in told[0].chapters:
        assert chapter.findings
        assert chapter.scenarios
        for finding in chapter.findings:
            assert re.search(r"\d|`", finding.text)
            assert "nan" not in finding.text
            assert finding.text.endswith(".")
            assert not finding.text.endswith("..")


def test_without_outcomes_nothing_is_concluded() -> None:
    """Results of the first release: one sentence, and no star."""
    rows = make_rows({"a": {}, "b": {"outcome": "late"}}).assign(
        outcome="", feasible="", situation="", robot=""
    )
    said = conclusions(rows)
    assert len(said) == 1
    assert "nothing is concluded" in said[0]
