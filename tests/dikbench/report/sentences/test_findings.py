from __future__ import annotations

import math

import pandas as pd
from hypothesis import given
from hypothesis import strategies as st
from makers.rows import make_rows

from dikbench.report.sentences.findings import (
    fail_most,
    fastest,
    keep_limits,
    keepers,
    most_accurate,
    most_accurate_within_limits,
    stay_on_course,
)
from dikbench.report.sentences.paired_wins import ROUNDING, SAME, lead
from dikbench.report.sentences.words import Names, number

THREE = ("reach", "near-miss[miss=0.02]", "near-miss[miss=0.005]")
TOO_FAST = {"velocity_violation_max_rad_s": 1.0, "velocity_peak_ratio": 3.0}


def test_the_closest_law_is_named_with_its_number_and_the_next_one() -> None:
    """The median, the runner-up and in how many trials it was behind stand in the sentence."""
    rows = make_rows(
        {
            "far": {"position_error_rms_m": [0.004, 0.005, 0.001]},
            "near": {"position_error_rms_m": [0.001, 0.002, 0.003]},
        },
        THREE,
    )
    text = most_accurate(rows, Names(rows)).text
    assert "`near` with 2 mm (rms, median over 3 trials)" in text
    assert "next is `far` with 4 mm, behind in 2 of 3" in text
    assert "Every limit is kept" in text


def test_laws_that_are_the_same_are_not_ranked() -> None:
    """Values that differ by less than 1 % are a tie, whoever comes first."""
    values = {"position_error_rms_m": 0.001}
    alike = {"position_error_rms_m": 0.001 * (1 + SAME / 2)}
    for contenders in (("a", "b"), ("b", "a")):
        said = {"a": values, "b": alike}
        rows = make_rows({name: said[name] for name in contenders}, THREE)
        found = most_accurate(rows, Names(rows)).text
        assert found.startswith(
            " and ".join(f"`{name}`" for name in contenders) + ", not told apart,"
        )
        assert "next is" not in found


def test_a_better_median_that_wins_too_few_trials_is_a_tie() -> None:
    """One scenario that moves the median does not make a formulation the best."""
    rows = make_rows(
        {
            "a": {"position_error_rms_m": [0.001, 0.002, 0.009]},
            "b": {"position_error_rms_m": [0.0005, 0.003, 0.004]},
        },
        THREE,
    )
    assert "not told apart" in most_accurate(rows, Names(rows)).text


@given(
    st.lists(
        st.lists(st.floats(1e-6, 1.0), min_size=3, max_size=3),
        min_size=2,
        max_size=5,
        unique_by=str,
    )
)
def test_a_lead_is_what_it_says(values: list[list[float]]) -> None:
    """Its value is the smallest median, and the runner-up loses twice as often as it wins."""
    rows = pd.DataFrame(
        [
            {
                "formulation": f"formulation{i}",
                "solver": "none",
                "scenario": s,
                "seed": 0,
                "error": value,
            }
            for i, contender in enumerate(values)
            for s, value in zip(THREE, contender, strict=True)
        ]
    )
    contenders = [(f"formulation{i}", "none") for i in range(len(values))]
    found = lead(rows, "error", contenders)
    assert found is not None
    medians = {contender: sorted(of)[1] for contender, of in zip(contenders, values, strict=True)}
    assert found.value == min(medians.values())
    assert min(medians, key=medians.__getitem__) in found.contenders
    if found.runner_up is not None:
        assert found.runner_up not in found.contenders
        assert found.runner_up_value > found.value * (1 + SAME)
        index = contenders.index(found.runner_up)
        leader = values[contenders.index(min(medians, key=medians.__getitem__))]
        clearly = [
            (b - a > SAME * a + ROUNDING, a - b > SAME * b + ROUNDING)
            for a, b in zip(leader, values[index], strict=True)
        ]
        wins, losses = (sum(column) for column in zip(*clearly, strict=True))
        assert found.wins == wins >= 2 * losses


def test_a_law_that_failed_or_whose_answers_are_wrong_leads_in_nothing() -> None:
    """Of survivors nothing is said, nor of a solver whose claims the recheck denies."""
    best, fair = {"position_error_rms_m": 1e-6}, {"position_error_rms_m": 0.01}
    rows = make_rows(
        {
            "survivor": {**best, "status": ["ok", "ok", "diverged"]},
            ("qp", "wrong"): {**best, "not_verified_share": 0.5},
            "fair": fair,
        },
        THREE,
    )
    names = Names(rows)
    assert most_accurate(rows, names).text.startswith("`fair` with 10 mm")
    assert keepers(rows) == [("fair", "none")]
    missing = rows[~((rows["formulation"] == "fair") & (rows["scenario"] == "reach"))]
    assert most_accurate(missing, names).text.startswith("No formulation in this run")


def test_without_a_keeper_no_law_is_named() -> None:
    """Where every law passes a limit the sentences say that none qualifies, and by how much."""
    rows = make_rows({"a": TOO_FAST, "b": TOO_FAST}, THREE)
    names = Names(rows)
    assert (
        keep_limits(rows, names).text
        == "No formulation in this run keeps every limit in all 3 trials."
    )
    assert most_accurate_within_limits(rows, names).text.startswith("No formulation in this run")
    assert "joint speeds reach 3 times their limit" in most_accurate(rows, names).text


def test_a_solvers_tolerance_breaks_no_limit_and_more_does() -> None:
    """Limits passed by less than 1e-4 are kept; one violation in one trial is one too many."""
    tolerance = {"velocity_violation_max_rad_s": 9e-5, "position_violation_max_rad": 9e-5}
    rows = make_rows(
        {
            "kept": tolerance,
            "once": {"position_violation_max_rad": [0.0, 0.0, 1e-3]},
            "hard": {"acceleration_violation_max_rad_s2": [0.0, 0.0, 1.0]},
            "touches": {"distance_violation_max_m": [float("nan"), 2e-4, 0.0]},
            "strains": {"torque_violating_share": [float("nan"), float("nan"), 0.01]},
        },
        THREE,
    )
    assert keepers(rows) == [("kept", "none")]


def test_who_stays_on_course_and_who_of_them_gets_on() -> None:
    """The course is kept within a degree; of those inside the limits the fastest is named."""
    rows = make_rows(
        {
            "exact": TOO_FAST,
            "slow": {"progress_mean": 0.4},
            "less slow": {"progress_mean": 0.8, "direction_error_max_rad": math.radians(0.9)},
            "astray": {"direction_error_max_rad": [0.0, 0.0, 1.0]},
        },
        THREE,
    )
    text = stay_on_course(rows, Names(rows)).text
    assert "`exact`, `slow` and `less slow`: never more than 1 deg off" in text
    assert "Within the limits `less slow` gets on best, at 80 %" in text
    astray = rows[rows["formulation"] == "astray"]
    assert (
        "No formulation in this run stays within 1 deg" in stay_on_course(astray, Names(rows)).text
    )


def test_who_fails_most() -> None:
    """By trials that broke off; where none did, by steps without an answer."""
    rows = make_rows(
        {"a": {"status": ["ok", "timeout", "crashed"]}, "b": {"status": ["ok", "ok", "timeout"]}},
        THREE,
    )
    text = fail_most(rows, Names(rows)).text
    assert text.startswith("`a`: 66.7 % of the trials (2 trials: ")
    assert "1 timeout" in text
    assert "1 crashed" in text
    rows = make_rows({"a": {"infeasible_share": 0.25}, "b": {}}, THREE)
    assert "No trial failed; `a` had no answer in up to 25 %" in fail_most(rows, Names(rows)).text
    in_turns = {"infeasible_share": [0.9, 0.0, 0.0], "solver_failed_share": [0.05, 0.8, 0.0]}
    rows = make_rows({"a": in_turns, "b": {}}, THREE)
    assert "`a` had no answer in up to 95 %" in fail_most(rows, Names(rows)).text
    rows = make_rows({"b": {}}, THREE)
    assert fail_most(rows, Names(rows)).text == "No trial failed and every step was answered."


def test_who_fails_once_in_many_trials_is_named_alone() -> None:
    """However small the share, of trials or of steps; who never failed is not among them."""
    seeds = range(120)
    rows = make_rows({"a": {}, "b": {}}, seeds=seeds)
    rows.loc[rows["formulation"].eq("b") & rows["seed"].eq(7), "status"] = "timeout"
    text = fail_most(rows, Names(rows)).text
    assert text == "`b`: 0.833 % of the trials (1 trial: 1 timeout)."
    rows = make_rows({"a": {"solver_failed_share": 0.002}, "b": {}, "c": {}}, seeds=seeds)
    text = fail_most(rows, Names(rows)).text
    assert "`a` had no answer in up to 0.2 % of a run's steps, and was slowed down" in text
    rows = make_rows({"a": {"infeasible_share": 0.002}, "b": {"infeasible_share": 0.002}, "c": {}})
    assert "`a` and `b` had no answer" in fail_most(rows, Names(rows)).text


def test_a_skipped_trial_is_no_failure() -> None:
    """It is neither counted as one nor among the trials."""
    rows = make_rows(
        {"a": {"status": ["timeout", "ok", "skipped"]}, "b": {"status": "skipped"}}, THREE
    )
    assert fail_most(rows, Names(rows)).text == "`a`: 50 % of the trials (1 trial: 1 timeout)."
    rows = make_rows({"a": {"status": "skipped"}}, THREE)
    assert fail_most(rows, Names(rows)).text == "No trial was run."


def test_times_that_a_stable_cell_may_drift_apart_are_a_tie() -> None:
    """Formulations within 25 % share the first place; unstable cells are counted beside it."""
    times = {"a": 10.0, "b": 12.0, "c": 100.0}
    rows = make_rows(
        {
            name: {"formulation_time_median_us": t, "timing_stability": "stable"}
            for name, t in times.items()
        },
        THREE,
    )
    names = Names(rows)
    text = fastest(rows, [("c", "none")], names).text
    assert text.startswith("`a` and `b` take 10 to 12 us a call, which is not told apart")
    assert "of those that keep every limit `c` takes 100 us a call" in text
    assert "the slowest, `c`, takes 10 times as long" in text
    assert "not stable" not in text
    rows.loc[0, "timing_stability"] = "drift: a lot"
    assert "Of 9 timed cells 1 are not stable" in fastest(rows, [], names).text
    assert fastest(make_rows({"a": {}}), [], names).text == "No times were taken."


def test_solvers_are_named_as_shortly_as_they_can() -> None:
    """All of them, all but a few, or one by one."""
    rows = make_rows(
        {("qp", solver): {} for solver in ("daqp", "osqp", "piqp", "highs")} | {"a": {}}
    )
    names = Names(rows)
    assert names.of([("a", "none")]) == "`a`"
    every = [("qp", solver) for solver in ("daqp", "osqp", "piqp", "highs")]
    assert names.of(every) == "`qp` (all 4 solvers)"
    assert names.of(every[1:]) == "`qp` (all solvers but `daqp`)"
    assert names.of(every[:2]) == "`qp` (`daqp` and `osqp`)"


@given(st.floats(1e-8, 1e8))
def test_a_number_in_a_sentence_is_the_number(value: float) -> None:
    """Three significant digits: within half a percent of the value, and readable as a number."""
    assert math.isclose(float(number(value)), value, rel_tol=5.001e-3)
