"""Answers from rows that nobody ran."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import pandas as pd
from makers.rows import make_rows

from dikbench.advice.answering import answer
from dikbench.advice.in_words import answer_in_words
from dikbench.advice.needs import Need

ON_PATH, ON_TIME, LIMITS = Need("on-path"), Need("on-time"), Need("limits")

CASES = [f"{family}[speed=0.{n}]" for family in ("near-miss", "step") for n in range(1, 9)]

GOOD: dict[str, Any] = {"contour_error_6d_max_m": 0.001}
BROKEN: dict[str, Any] = {"outcome": "limit-broken", "decided_before": "limit-broken"}
STANDS: dict[str, Any] = {
    "outcome": "unfinished", "path_done_99_tolerance_m": 0.5, "path_done_90_tolerance_m": 0.5,
    "contour_error_6d_max_m": 0.0,
}  # fmt: skip
"""Who stands still is on its path, and does none of it."""


def rows(laws: Mapping[str, Mapping[str, Any]]) -> pd.DataFrame:
    """Make rows of both references."""
    named: dict[str | tuple[str, str], Mapping[str, Any]] = {name: laws[name] for name in laws}
    parts = [make_rows(named, scenarios=CASES, reference=each) for each in ("path", "time")]
    return pd.concat(parts, ignore_index=True)


def some(values: Mapping[str, Any], share: float) -> dict[str, list[Any]]:
    """Make values of which only a share of the cases differ from a good trial, spread evenly."""
    whole = {**{"outcome": "success", "decided_before": "", "path_done_99_tolerance_m": 0.0,
                "path_done_90_tolerance_m": 0.0}, **GOOD}  # fmt: skip
    bad = {**whole, **values}
    every = [int((n + 1) * share) > int(n * share) for n in range(len(CASES))]
    return {name: [bad[name] if is_bad else whole[name] for is_bad in every] for name in whole}


def test_who_does_most_is_recommended_with_its_numbers() -> None:
    """And who is told apart is not tied."""
    found = answer(ON_PATH, rows({"good": GOOD, "half": some(STANDS, 0.4)}))
    assert found.first is not None
    assert (found.first.formulation, found.first.failed, found.first.runs) == ("good", 0, 16)
    assert found.tied == ()
    assert found.runner_up is not None
    assert found.runner_up.formulation == "half"
    assert found.runner_up.failed == 6
    text = answer_in_words(found)
    assert "`good`: 0 of 16 runs" in text
    assert "`half` (6 of 16 runs)" in text


def test_equal_laws_are_tied_whatever_their_names() -> None:
    """The sentence names the other one."""
    for names in (("a", "b"), ("b", "a")):
        found = answer(ON_PATH, rows({name: GOOD for name in names}))
        assert found.first is not None
        assert {found.first.formulation, *(e.formulation for e in found.tied)} == {"a", "b"}
        assert "not told apart" in answer_in_words(found)


def test_a_difference_of_one_case_is_a_tie() -> None:
    """One of 16 cases tells nobody apart."""
    found = answer(ON_PATH, rows({"good": GOOD, "nearly": some(STANDS, 1 / 16)}))
    assert found.first is not None
    assert found.first.formulation == "good"
    assert [each.formulation for each in found.tied] == ["nearly"]


def test_who_stands_still_or_ignores_limits_is_never_recommended() -> None:
    """For no need: not for keeping limits, nor for accuracy where none is near."""
    laws = {
        "idle": STANDS,
        "reckless": some(BROKEN, 0.2) | {"contour_error_6d_max_m": 0.0},
        "good": some(STANDS, 0.2),
        "poor": some(STANDS, 0.6),
    }
    for need in (ON_PATH, ON_TIME, LIMITS):
        found = answer(need, rows(laws))
        named = [found.first, *found.tied, *found.left_behind]
        assert {each.formulation for each in named if each is not None} <= {"good", "poor"}
        assert found.first is not None
        assert found.first.formulation == "good"
        assert found.runner_up is None or found.runner_up.formulation == "poor"
        assert "idle" not in answer_in_words(found)
        assert "reckless" not in answer_in_words(found)


def test_straw_laws_change_nothing_about_the_others() -> None:
    """The answer is the same with and without them."""
    honest = {"good": some(STANDS, 0.2), "poor": some(STANDS, 0.6)}
    for need in (ON_PATH, ON_TIME, LIMITS):
        alone = answer(need, rows(honest))
        beside = answer(need, rows({**honest, "idle": STANDS, "reckless": some(BROKEN, 0.3)}))
        assert alone.first == beside.first
        assert alone.tied == beside.tied
        assert alone.runner_up == beside.runner_up


def test_where_all_are_straw_nothing_is_recommended() -> None:
    """And the reason is given."""
    found = answer(ON_PATH, rows({"reckless": some(BROKEN, 0.5)}))
    assert found.first is None
    assert "no formulation that was tried is dependable" in answer_in_words(found)


def test_of_few_cases_nothing_is_said() -> None:
    """Five at least, of which a motion is known."""
    few = make_rows({"good": GOOD}, scenarios=CASES[:4], reference="path")
    assert answer(ON_PATH, few).first is None
    assert "too few" in answer(ON_PATH, few).reason
    nobody = rows({"good": {**GOOD, "feasible": "no"}})
    assert answer(ON_PATH, nobody).reason.startswith("0 cases")


def test_who_was_left_behind_without_being_told_apart_is_named() -> None:
    """A law that ran six cases as well as the best is not called worse; one that failed is."""
    trials = rows({"good": GOOD, "early": GOOD, "bad": STANDS})
    whole = trials["formulation"].eq("good") | trials["scenario"].isin([*CASES[:3], *CASES[8:11]])
    found = answer(ON_PATH, trials[whole].reset_index(drop=True))
    assert found.first is not None
    assert found.first.formulation == "good"
    assert [each.formulation for each in found.left_behind] == ["early"]
    assert [each.formulation for each in found.others] == ["bad"]


def test_a_smaller_tolerance_is_another_answer() -> None:
    """Who stays within 5 mm need not stay within 0.5."""
    laws = {"near": {"contour_error_6d_max_m": 1e-4}, "far": {"contour_error_6d_max_m": 2e-3}}
    assert answer(ON_PATH, rows(laws)).tied
    strict = answer(Need("on-path", 0.0005), rows(laws))
    assert strict.first is not None
    assert strict.first.formulation == "near"
    assert strict.tied == ()
