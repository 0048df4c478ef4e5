"""What each sentence says, of rows that were made for it."""

from __future__ import annotations

from typing import Any

import pandas as pd
import pytest
from makers.rows import Values, make_rows

from dikbench.report.sentences.findings import (
    broke_off,
    fastest,
    first_most_often,
    leaders,
    most_accurate,
    unanswered,
)
from dikbench.report.sentences.sample import cases_in_words
from dikbench.report.sentences.words import Names

SCENARIOS = tuple(f"family{k % 6}[k={k}]" for k in range(24))
FAILS: Values = {"outcome": ["left-path" if k % 3 else "success" for k in range(24)]}


def _rows(formulations: dict[Any, Values], reference: str = "path") -> pd.DataFrame:
    return make_rows(formulations, SCENARIOS, reference=reference)


def _all(rows: pd.DataFrame) -> set[tuple[str, str]]:
    return {(f, s) for f, s in zip(rows["formulation"], rows["solver"], strict=True)}


def _first(rows: pd.DataFrame, setting: Any = "path") -> str:
    found = leaders(rows, setting, _all(rows), Names(rows))
    assert found is not None
    return f"{found.finding.question}: {found.finding.text}"


def test_the_first_is_named_with_its_rate_and_the_next_one() -> None:
    """Eight of 24 succeed with b: a third, 67 points less, give or take."""
    text = _first(_rows({"a": {}, "b": FAILS}))
    assert text.startswith(
        "First where the path may wait: success of 24 cases (24 scenarios of one robot, ur5): "
        "`a` with 100 %; next of the candidates is `b` with 33.3 %, "
    )
    low, high = text.split("33.3 %, ")[1].split(" points less")[0].split(" to ")
    assert 30 < float(low) < 66.7 < float(high) <= 100
    assert text.endswith("Median time over the 24 cases that it did: the nominal duration.")


def test_where_all_tie_nobody_stands_out() -> None:
    """Whoever comes first; the rates are said."""
    for names in (("a", "b"), ("b", "a")):
        text = _first(_rows({name: {} for name in names}), "time")
        assert text == (
            "Nobody stands out where the clock does not wait: success of 24 cases (24 scenarios of "
            "one robot, ur5): all 2 candidates have 100 %."
        )


def test_who_is_as_successful_and_slower_is_not_first() -> None:
    """Twice the duration is; 2 % more is not."""
    text = _first(_rows({"a": {}, "b": {"slow_down": 2.0}, "c": {"slow_down": 1.02}}))
    assert text.startswith("First where ")
    assert "`a` and `c` with 100 %, not told apart; slower: `b` with 100 %. Median" in text
    assert text.endswith("24 cases that all of them did: 1 to 1.02 times the nominal duration.")
    assert "next" not in text


def test_ties_end_where_somebody_can_be_told_apart() -> None:
    """Who rarely differs but is worse than one that clearly does is not first."""
    few = make_rows({"a": {}, "c": FAILS, "b": {}}, SCENARIOS)
    part = few["formulation"].eq("b") & few["scenario_family"].eq("family0")
    few.loc[part, "outcome"] = "late"
    few.loc[few["formulation"].eq("c") & ~part, "outcome"] = "success"
    found = leaders(few, "time", _all(few), Names(few))
    assert found is not None
    rates = dict(zip(found.found.contenders["formulation"], found.found.rate, strict=True))
    apart = dict(zip(found.found.contenders["formulation"], found.found.upper < 0, strict=True))
    least = max((rates[name] for name in rates if apart[name]), default=0.0)
    assert all(rates[name] >= least for name, _ in found.contenders)


def test_nobody_is_named_where_nobody_succeeds_or_may_be_first() -> None:
    """No sentence, where nothing can be said."""
    rows = _rows({"a": {"outcome": "late"}, "b": {"outcome": "late"}})
    assert leaders(rows, "path", _all(rows), Names(rows)) is None
    rows = _rows({"a": {}, "b": {}})
    assert leaders(rows, "path", set(), Names(rows)) is None


def test_who_is_not_told_of_obstacles_is_not_compared_there() -> None:
    """A formulation that cannot see them is neither first nor next."""
    rows = _rows({"a": {"sees_constraints": 1.0}, "b": {**FAILS, "sees_constraints": 0.0}})
    text = _first(rows)
    assert text.startswith("The only candidate where the path may wait: ")
    assert "`a` with 100 %." in text
    assert "`b`" not in text


def _partly(count: int) -> Values:
    """Fail all of the first `count` families of six, which are drawn as such."""
    return {"outcome": ["late" if k % 6 < count else "success" for k in range(24)]}


def test_a_lead_that_the_rows_do_not_carry_is_no_first_place() -> None:
    """Two families of six more: 33 points, and 0 in some resample; with five it is told apart."""
    text = _first(_rows({"a": {}, "b": _partly(2)}))
    assert text.startswith("May be first where the path may wait: ")
    assert "`a` with 100 %; `b` with 66.7 %, not told apart." in text
    assert "next" not in text
    text = _first(_rows({"b": _partly(2), "c": _partly(5), "a": {}}))
    assert text.startswith("May be first where ")
    assert "`a` with 100 %; `b` with 66.7 %, not told apart; next of the candidates is `c`" in text
    assert _first(_rows({"a": {}, "c": _partly(5)})).startswith("First where ")


def test_who_may_be_first_but_is_slower_is_not_named() -> None:
    """Beyond doubt, where both succeed: it is named as such, and the other one is first."""
    text = _first(_rows({"a": {}, "b": {**_partly(2), "slow_down": 2.0}}))
    assert text.startswith("First where ")
    assert "`a` with 100 %; slower: `b` with 66.7 %. Median time" in text


def test_who_does_as_well_and_is_stopped_elsewhere_is_named_as_such() -> None:
    """Only if it is as successful as the best; in the words of the share in which it is stopped."""
    rows = _rows({"a": {}, "b": _partly(5), "c": {}, "d": _partly(1)})
    barred = {("c", "none"): 0.125, ("d", "none"): 0.2}
    found = leaders(rows, "time", [("a", "none"), ("b", "none")], Names(rows), barred)
    assert found is not None
    assert found.finding.text.endswith(
        " points less; as successful, but no candidate (stopped in 12.5 % of all trials): `c`."
    )
    assert found.contenders == (("a", "none"),)
    rows = _rows({"a": {}, "b": {}, "c": {}})
    found = leaders(rows, "time", [("a", "none"), ("b", "none")], Names(rows), barred)
    assert found is not None
    assert found.finding.text.endswith("all 2 candidates have 100 %.")


def test_after_a_few_rates_the_others_are_counted() -> None:
    """Eight of whom nobody can be told apart, since a family decides: five rates and the rest."""
    first = [k % 6 == 0 and k < 6 * n for n in range(5) for k in range(24)]
    second = [k % 6 == 0 or (k % 6 == 1 and k < 6 * n) for n in (1, 2, 3) for k in range(24)]
    fails = [*first, *second]
    laws: dict[Any, Values] = {
        f"f{n}": {
            "outcome": ["late" if fail else "success" for fail in fails[24 * n : 24 * n + 24]]
        }
        for n in range(8)
    }
    rows = _rows(laws)
    text = _first(rows)
    assert text.startswith("May be first where ")
    assert "`f0` with 100 %; `f1` with 95.8 %; `f2` with 91.7 %" in text
    assert "; 3 more with 70.8 to 79.2 %, not told apart" in text


def test_the_sample_says_of_which_robots_it_is() -> None:
    """Scenarios of each, most first; who has more than half of the cases is said to."""
    rows = _rows({"a": {}}).assign(robot=["ur5"] * 13 + ["panda"] * 5 + ["iiwa"] * 6)
    words = "24 scenarios of 3 robots, ur5 13, iiwa 6 and panda 5"
    assert cases_in_words(rows) == f"24 cases ({words}; ur5 has 13 of the cases)"
    rows.loc[0, "robot"] = "`my`\n arm.urdf"
    words = "24 scenarios of 4 robots, ur5 12, iiwa 6, panda 5 and 'my' arm.urdf 1"
    assert cases_in_words(rows) == f"24 cases ({words})"


def test_a_pace_over_a_few_scenarios_is_not_told() -> None:
    """Five scenarios in common are; four are not."""
    for count, said in ((5, True), (4, False)):
        done = ["success" if k < count else "left-path" for k in range(24)]
        rows = _rows({"a": {"outcome": done}, "b": {"outcome": done, "slow_down": 1.02}})
        text = _first(rows)
        over = "Median time over the 5 cases that all of them did: 1 to 1.02 times the nominal"
        assert (over in text) == ("Median" in text) == said


def test_the_most_accurate_of_the_first_is_named_with_its_distance() -> None:
    """Of trials that all of them did; the other is three times as far."""
    rows = _rows({"a": {"contour_error_6d_max_m": 0.001}, "b": {"contour_error_6d_max_m": 0.003}})
    found = leaders(rows, "path", _all(rows), Names(rows))
    assert found is not None
    said = most_accurate(rows, found, Names(rows))
    assert said is not None
    assert said.text == (
        "of these `a`, 1 mm from the path at most; next is `b`, 3 times as far as the nearest "
        "(geometric means, paired over the 24 cases that all of them did, in 24 scenarios of which "
        "they are more than 0.01 mm apart; less than 0.01 mm counts as 0.01 mm, angles with 0.2 m)."
    )


@pytest.mark.parametrize("scenarios", [4, 5])
def test_accuracy_is_told_of_five_scenarios_that_ask_for_more_than_rounding(scenarios: int) -> None:
    """In the others both are as near as the sampling; all are of one family, where one decides."""
    names = [f"family[k={k}]" for k in range(24)]
    far = [3e-3 if k < scenarios else 2e-6 for k in range(24)]
    near = [1e-3 if k < scenarios else 1e-6 for k in range(24)]
    rows = make_rows(
        {"a": {"contour_error_6d_max_m": near}, "b": {"contour_error_6d_max_m": far}},
        names, reference="path",
    )  # fmt: skip
    found = leaders(rows, "path", _all(rows), Names(rows))
    assert found is not None
    said = most_accurate(rows, found, Names(rows))
    assert (said is not None) == (scenarios >= 5)
    assert said is None or "in 5 scenarios of which" in said.text


def test_distances_are_geometric_means_of_the_same_cases_as_the_ratio() -> None:
    """1 and 4 mm by turns are 2 mm, not a median; 0 counts as 0.01 mm; who fails leaves a case."""
    near = [1e-3, 4e-3] * 12
    far = [8e-3, 2e-3] * 12
    rows = _rows({"a": {"contour_error_6d_max_m": near}, "b": {"contour_error_6d_max_m": far}})
    found = leaders(rows, "path", _all(rows), Names(rows))
    assert found is not None
    assert most_accurate(rows, found, Names(rows)) is None  # by turns: not told apart
    twice = [2 * value for value in near]
    rows = _rows({"a": {"contour_error_6d_max_m": near}, "b": {"contour_error_6d_max_m": twice}})
    said = most_accurate(rows, found, Names(rows))
    assert said is not None
    assert "`a`, 2 mm from the path at most; next is `b`, 2 times as far" in said.text
    rows = _rows({"a": {"contour_error_6d_max_m": 0.0}, "b": {"contour_error_6d_max_m": 1e-4}})
    rows.loc[rows["scenario"].eq("family0[k=0]") & rows["formulation"].eq("a"), "outcome"] = "late"
    said = most_accurate(rows, found, Names(rows))
    assert said is not None
    assert "`a`, 0.01 mm from the path at most; next is `b`, 10 times as far" in said.text
    assert "over the 23 cases" in said.text


def test_distances_that_hardly_differ_are_not_ranked() -> None:
    """3 % is no difference worth a sentence; nor is anything below a hundredth of a millimetre."""
    for near, far in ((0.001, 0.00103), (1e-9, 1e-6)):
        rows = _rows({"a": {"contour_error_6d_max_m": near}, "b": {"contour_error_6d_max_m": far}})
        found = leaders(rows, "path", _all(rows), Names(rows))
        assert found is not None
        assert most_accurate(rows, found, Names(rows)) is None


def test_targets_at_rest_say_nothing_of_accuracy() -> None:
    """They have no path."""
    rows = _rows(
        {"a": {"contour_error_6d_max_m": 0.001}, "b": {"contour_error_6d_max_m": 0.003}}
    ).assign(judged_by_path=0.0)
    found = leaders(rows, "path", _all(rows), Names(rows))
    assert found is not None
    assert most_accurate(rows, found, Names(rows)) is None


def test_who_broke_off_is_named_with_the_reasons() -> None:
    """Every one of them; a skipped trial is none; nobody where all ran."""
    rows = make_rows(
        {
            "a": {"status": ["timeout", "crashed", "skipped"],
                  "outcome": ["did-not-run", "did-not-run", ""]},
            "b": {"status": ["ok", "ok", "diverged"], "outcome": ["late", "success", "diverged"]},
            "c": {},
        },
        SCENARIOS[:3],
    )  # fmt: skip
    found = broke_off(rows.iloc[::-1], Names(rows))
    assert found is not None
    assert found.text == (
        "`a` in 2 of 2 trials (1 crashed and 1 timeout) and `b` in 1 of 3 trials (1 diverged)."
    )
    assert broke_off(rows[rows["formulation"].eq("c")], Names(rows)) is None


def test_who_had_no_answer_is_named_with_the_largest_share() -> None:
    """Infeasible steps and failures of the solver of a run together."""
    in_turns = {"infeasible_share": [0.9, 0.0, 0.0], "solver_failed_share": [0.05, 0.8, 0.0]}
    rows = make_rows({"a": in_turns, "b": {"infeasible_share": 0.2}, "c": {}}, SCENARIOS[:3])
    found = unanswered(rows, Names(rows))
    assert found is not None
    said = "`a` posed programs without a feasible point, or got no answer, in up to 95 % of a run's"
    assert found.text.startswith(said)
    assert unanswered(rows[rows["formulation"].eq("c")], Names(rows)) is None


def test_who_is_first_most_often() -> None:
    """Counted where somebody stands out, in two situations at least."""
    names = Names(make_rows({"a": {}, "b": {}}))
    a, b = ("a", "none"), ("b", "none")
    found = first_most_often([("path", (a, b)), ("path", (a,)), ("time", (b,))], names)
    assert [(each.question, each.text) for each in found] == [
        (
            "First most often where the path may wait",
            "`a`, alone or tied, in 2 of the 2 situations in which somebody stands out.",
        )
    ]


def test_times_that_a_stable_cell_may_drift_apart_are_a_tie() -> None:
    """Formulations within the drift share the first place; the slowest is named, in ratios."""
    times = {"a": 10.0, "b": 12.0, "c": 100.0, "d": 1.0}
    rows = make_rows(
        {
            name: {"formulation_time_median_us": t, "timing_stability": "stable"}
            for name, t in times.items()
        },
        SCENARIOS[:3],
    )
    names, among = Names(rows), [("a", "none"), ("b", "none"), ("c", "none")]
    found = fastest(rows, among, names)
    assert found is not None
    assert found.text == (
        "`a` and `b`, 0.01 ms a call (not told apart: a stable time may drift by 25 %); the "
        "slowest, `c`, takes 10 times as long (medians over 3 scenarios)."
    )
    rows.loc[0, "timing_stability"] = "drift: a lot"
    again = fastest(rows, among, names)
    assert again is not None
    assert "of 9 timed cells 1 cannot be trusted" in again.text
    assert fastest(rows, among[:1], names) is None
    assert fastest(rows, [], names) is None
    assert fastest(make_rows({"a": {}, "b": {}}), among, names) is None
