"""Instances: reproducible by number, in own streams, robots in equal shares, none shared."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import pandas as pd
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from makers.rows import make_rows
from msgspec import to_builtins
from msgspec.structs import replace

from dikbench.errors import DikbenchError
from dikbench.plugins.building import make_family, make_scenario
from dikbench.plugins.drawing import SEEDS_APART, drawn_cell, drawn_parameters, drawn_robots
from dikbench.plugins.finding import plugins, scenario_plugin
from dikbench.report.sentences import limitations
from dikbench.report.sentences.limitations import in_plan
from dikbench.report.tables.instances import instances_table
from dikbench.results.folder import ResultsFolder
from dikbench.results.instances import INSTANCES, read_attempts
from dikbench.run.folder_of_instances import instances_in
from dikbench.selector import Selector, parse_selector
from dikbench.study import instances
from dikbench.study.instances import (
    Attempt,
    accepted,
    draw,
    draw_instance,
    draw_missing,
    instances_among,
)
from dikbench.study.selection import Selection, select
from dikbench.study.split import SPLITS, split_of
from dikbench.study.study import Study, load_study

DRAWN = sorted(set(plugins("scenario")) - {"csv"})

CHEAP = "reach"


def _study(**changes: Any) -> Study:
    selection = Selection(formulations=("pinv",), scenarios=(CHEAP,), instances=6)
    return select(load_study("quick"), replace(selection, **changes), named=False)


@settings(max_examples=80, deadline=None)
@given(st.sampled_from(DRAWN), st.integers(1, 999), st.integers(0, 60))
def test_what_is_drawn_is_exact_as_text_and_inside_its_range(
    name: str, number: int, attempt: int
) -> None:
    """The text gives the same selector, numbers have four digits, and drawing again the same."""
    cell = drawn_cell(Selector(name), number, attempt)
    assert cell == drawn_cell(Selector(name), number, attempt)
    selector, seed = cell
    again = parse_selector(str(selector))
    assert str(again) == str(selector)
    assert split_of(seed) == split_of(number)
    for key, parameter in drawn_parameters(scenario_plugin(name), Selector(name)).items():
        text = again.parameters[key]
        if parameter.choices:
            assert text in map(str, parameter.choices)
            continue
        assert parameter.drawn is not None
        assert parameter.drawn.low <= float(text) <= parameter.drawn.high
        assert parameter.type is int or float(text) == float(f"{float(text):.4g}")
        assert repr(parameter.type(text)) == text
    try:
        family = make_family(again)
    except DikbenchError:  # such as an elbow that the robot has not
        return
    assert all(str(getattr(family, key)) == text for key, text in again.parameters.items())


@pytest.mark.parametrize("name", ["near-miss", "speed-sweep", "obstacle"])
def test_a_parameter_that_is_given_moves_no_other(name: str) -> None:
    """Each has a stream of its own, whether the others are drawn or fixed."""
    whole = drawn_cell(Selector(name), 117)[0].parameters
    for fixed in drawn_parameters(scenario_plugin(name), Selector(name)):
        drawn = drawn_cell(Selector(name, {fixed: "0.0123"}), 117)[0].parameters
        assert drawn == {**whole, fixed: "0.0123"}
    assert drawn_cell(Selector(name, {"robot": "ur10"}), 117)[0].parameters == {
        **whole,
        "robot": "ur10",
    }


def test_the_streams_of_parameters_numbers_attempts_and_families_differ() -> None:
    """Nothing repeats where it should not."""
    drawn = [
        drawn_cell(Selector(name), number, attempt)[0].parameters["speed"]
        for name in ("near-miss", "random-joint-path", "speed-sweep")
        for number in (1, 2, 100)
        for attempt in (0, 1)
    ]
    assert len(set(drawn)) == len(drawn)


@pytest.mark.parametrize("name", DRAWN)
def test_robots_are_in_equal_shares_and_stay_with_their_number(name: str) -> None:
    """By number, whatever is rejected."""
    robots = drawn_robots(scenario_plugin(name), Selector(name))
    turns = [drawn_cell(Selector(name), n)[0].parameters["robot"] for n in range(100, 200)]
    counts = Counter(turns)
    assert set(counts) == set(robots)
    assert max(counts.values()) - min(counts.values()) <= 1
    later = [drawn_cell(Selector(name), n, 7)[0].parameters["robot"] for n in range(100, 200)]
    assert later == turns


def test_a_logarithm_is_drawn_uniformly_where_it_is_declared() -> None:
    """Half of them are below the geometric mean, of a number drawn linearly below the middle."""
    drawn = [drawn_cell(Selector("near-miss"), n)[0].parameters for n in range(100, 1000)]
    below = sum(float(each["miss"]) < (0.002 * 0.05) ** 0.5 for each in drawn)
    assert abs(below - 450) < 75  # five standard deviations
    swept = [drawn_cell(Selector("speed-sweep"), n)[0].parameters for n in range(100, 1000)]
    assert abs(sum(float(each["radius"]) < 0.1 for each in swept) - 450) < 75


def test_what_is_rejected_is_drawn_again_with_its_robot_and_counted() -> None:
    """Every scenario that is left builds; each rejected one does not, for the reason it gives."""
    attempts = draw(parse_selector("near-miss"), range(100, 116))
    cells = accepted(attempts)
    assert [seed % SEEDS_APART for _, seed in cells] == [*range(100, 116)]
    rejected = [each for each in attempts if each.rejected]
    assert rejected
    for each in rejected:
        with pytest.raises(DikbenchError) as caught:
            make_scenario(each.scenario, each.seed)
        assert str(caught.value) == each.rejected
    for selector, seed in cells[:4]:
        assert make_scenario(selector, seed).steps > 0
    robot = {each.number: parse_selector(each.scenario).parameters["robot"] for each in attempts}
    assert all(parse_selector(a.scenario).parameters["robot"] == robot[a.number] for a in attempts)
    table = instances_table(attempts)
    assert table["accepted"].sum() == 16
    assert table["rejected"].sum() == len(rejected)
    assert table.loc[table["rejected"] > 0, "first_reasons"].ne("").all()
    alone = draw_instance(parse_selector("near-miss"), rejected[0].number)
    assert alone == [each for each in attempts if each.number == rejected[0].number]


@pytest.mark.parametrize("most", [2, 3])
def test_an_instance_that_nothing_is_found_for_is_an_error(
    monkeypatch: pytest.MonkeyPatch, most: int
) -> None:
    """One line that names family, robot, number and the last reason."""
    monkeypatch.setattr(instances, "MOST_ATTEMPTS", most)
    with pytest.raises(DikbenchError) as caught:
        draw(parse_selector("near-miss[robot=talos,singularity=wrist]"), [101])
    text = str(caught.value)
    for part in ("near-miss", "robot talos", "instance 101", f"{most} attempts", "no wrist"):
        assert part in text
    assert "\n" not in text


@pytest.mark.parametrize(
    ("selector", "part"),
    [
        ("csv[file=tests/data/triangle.csv]", "leaves nothing to draw"),
        ("reach[robot=ur5,distance=0.1,angle=0.2]", "leaves nothing to draw"),
        ("no-such-family", "no-such-family"),
        ("reach[distanc=0.1]", "distanc"),
        ("reach[distance=9]", "distance=9"),
    ],
)
def test_what_cannot_be_drawn_is_an_error(selector: str, part: str) -> None:
    """Before anything is built."""
    with pytest.raises(DikbenchError, match=part):
        draw(parse_selector(selector), [100])


@pytest.mark.parametrize("number", [0, 1000, 1101])
def test_a_number_in_no_split_is_an_error(number: int) -> None:
    """The message says which are."""
    with pytest.raises(DikbenchError, match=r"1 to 99 .train. and 100 to 999 .test."):
        draw_instance(parse_selector(CHEAP), number)


def test_train_and_test_share_no_instance_and_no_seed() -> None:
    """Not at any attempt: seeds differ, and so does every number that is drawn."""
    cells: dict[str, set[tuple[str, int]]] = {}
    for name, numbers in SPLITS.items():
        cells[name] = {
            (str(selector), seed)
            for family in DRAWN
            for number in (*numbers[:12], numbers[-1])
            for attempt in (0, 1, instances.MOST_ATTEMPTS)
            for selector, seed in (drawn_cell(Selector(family), number, attempt),)
        }
        assert len(cells[name]) == len(DRAWN) * 13 * 3
    assert not {seed for _, seed in cells["train"]} & {seed for _, seed in cells["test"]}
    assert not cells["train"] & cells["test"]


def test_a_folder_keeps_its_instances_and_draws_only_what_it_lacks(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A smaller fraction is a prefix; a larger one continues; another source is drawn anew."""
    folder = ResultsFolder(tmp_path / "run")
    asked: list[list[int]] = []
    drawing = instances.draw

    def counted(given: Selector, numbers: Sequence[int], *more: Any) -> list[Attempt]:
        asked.append([*numbers])
        return drawing(given, numbers, *more)

    monkeypatch.setattr(instances, "draw", counted)
    half = instances_in(folder, _study(fraction=0.5))
    whole = instances_in(folder, _study())
    assert asked == [[100, 101, 102], [103, 104, 105]]
    assert whole[:3] == half
    assert instances_in(folder, _study(fraction=0.5)) == half
    assert len(asked) == 2
    assert whole == accepted(draw(parse_selector(CHEAP), range(100, 106)))
    kept = read_attempts(folder.path)
    file = folder.path / INSTANCES
    file.write_text(file.read_text().replace(kept[0].source, "0" * 16))
    assert instances_in(folder, _study()) == whole
    assert asked[-1] == [*range(100, 106)]
    assert read_attempts(folder.path) == kept
    file.write_text("given,number\nx,1\n")
    with pytest.raises(DikbenchError, match="not a table of instances"):
        instances_in(folder, _study())


@pytest.mark.long
@pytest.mark.parametrize("name", DRAWN)
def test_most_of_what_is_drawn_is_accepted(name: str) -> None:
    """At least half of the first attempts, of every family."""
    attempts: list[Attempt] = draw(parse_selector(name), range(100, 130))
    first = [each for each in attempts if each.seed < SEEDS_APART]
    assert sum(not each.rejected for each in first) >= len(first) / 2


def test_what_was_drawn_is_known_from_the_attempts() -> None:
    """Not what was rejected, has another number, or was drawn for another selector.

    Without attempts, what may have been drawn.
    """
    study = _study(scenarios=("near-miss", "reach[robot=ur5]"), instances=4)
    attempts = draw_missing(study)
    known = {(a.scenario, a.seed) for a in attempts if not a.rejected}
    others = {(a.scenario, a.seed) for a in attempts if a.rejected}
    others |= {("near-miss[miss=0.02]", 101), ("reach[robot=ur5,distance=0.1,angle=0.3]", 101)}
    others |= {(a.scenario, a.seed) for a in draw(parse_selector("near-miss"), [104])}
    others |= {(a.scenario, a.seed) for a in draw(parse_selector("near-miss[robot=ur5]"), [101])}
    assert len(known) == 8
    assert instances_among(known | others, study, attempts) == known
    maybe = instances_among({*known, ("step", 101), ("near-miss", 104)}, study, ())
    assert maybe == known


def test_each_instance_is_looked_up_once(monkeypatch: pytest.MonkeyPatch) -> None:
    """However many rows have it."""
    asked: list[set[tuple[str, int]]] = []
    looked_up = instances_among

    def counted(cells: Any, *more: Any) -> set[tuple[str, int]]:
        asked.append(cells)
        return looked_up(cells, *more)

    monkeypatch.setattr(limitations, "instances_among", counted)
    rows = make_rows({"pinv": {}, "dls": {}}, ("reach[robot=ur5]", "step"), seeds=(100, 101))
    study = to_builtins(_study(instances=1, formulations=("pinv", "dls")))
    assert list(in_plan(rows, study)) == [s == 100 and n != "step" for n, s in _cells(rows)]
    assert [len(cells) for cells in asked] == [4, 4]


def _cells(rows: pd.DataFrame) -> list[tuple[str, int]]:
    return list(zip(rows["scenario"], rows["seed"], strict=True))


FLAGGED = """
from dataclasses import dataclass
from typing import Annotated
from dikbench.scenario import Drawn
from scenarios.reach import Reach

@dataclass(frozen=True, kw_only=True)
class Flagged(Reach):
    flag: Annotated[bool, Drawn()] = False
"""


def test_a_bool_is_drawn_evenly(tmp_path: Path) -> None:
    """As a text of its value."""
    file = tmp_path / "flagged.py"
    file.write_text(FLAGGED)
    given = Selector(f"{file}:Flagged", {"distance": "0.1"})
    drawn = [drawn_cell(given, n)[0] for n in range(100, 500)]
    counts = Counter(each.parameters["flag"] for each in drawn)
    assert set(counts) == {"true", "false"}
    assert abs(counts["true"] - 200) < 50  # five standard deviations
    for each in drawn[:10]:
        family: Any = make_family(each)
        assert family.flag is (each.parameters["flag"] == "true")


def test_what_is_fixed_at_its_default_is_fixed() -> None:
    """Beside the same family with nothing fixed, in either order."""
    for order in (("near-miss", "near-miss[robot=ur5]"), ("near-miss[robot=ur5]", "near-miss")):
        attempts = draw_missing(_study(scenarios=order, instances=3))
        robots: dict[str, set[str]] = {}
        for attempt in attempts:
            drawn = parse_selector(attempt.scenario)
            robots.setdefault(attempt.given, set()).add(drawn.parameters["robot"])
        assert robots["near-miss[robot=ur5]"] == {"ur5"}
        assert len(robots["near-miss"]) == 3
