"""The table of failures: which trials, in which order, with which figure against which limit."""

from __future__ import annotations

from math import degrees, inf, nan

import numpy as np
import pandas as pd
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from makers.rows import Values, make_rows

from dikbench.metrics import Judgement, Outcome
from dikbench.report.tables.failures import (
    CASES,
    CASES_OF_EACH,
    QUANTITIES,
    failures,
)
from dikbench.robots.loading import load_robot
from dikbench.scenario.violation import Violation, broken_limit, collision

SPEED = {
    "outcome": "limit-broken",
    "decided_before": "limit-broken",
    "outcome_reason": "joint speed over its limit",
    "outcome_figure": 1.25,
    "outcome_step": 12.0,
    "velocity_peak_ratio": 29.0,
}
LEFT = {
    "outcome": "left-path",
    "outcome_reason": "orientation",
    "outcome_figure": 0.035,
    "contour_error_6d_max_m": 0.035,
    "outcome_step": 40.0,
}


def told(rows: pd.DataFrame) -> list[dict[str, object]]:
    """The cases of the table."""
    records: list[dict[str, object]] = failures(rows).cases.to_dict("records")  # type: ignore[assignment]
    return records


def test_a_failure_is_told_with_step_figure_and_limit_in_units_for_people() -> None:
    """The figure is the one that decided; the largest of the run stands beside it."""
    (case,) = told(make_rows({"a": SPEED, "b": {}}))
    assert case == {
        "formulation": "a",
        "scenario": "reach",
        "reference": "time",
        "seed": 0,
        "plant": "ideal",
        "outcome": "limit-broken",
        "at step": "12 of 100",
        "what": "joint speed over its limit",
        "figure": "1.25",
        "at most": "1.001",
        "largest": "29",
        "trials": 1,
        "id": "0",
    }
    (case,) = told(make_rows({("qp", "daqp"): LEFT}))
    assert (case["formulation"], case["figure"], case["at most"]) == ("qp, daqp", "35 mm", "5 mm")
    assert str(case["what"]).startswith("off the path, by orientation")


def test_the_worst_comes_first() -> None:
    """By outcome as they are asked for, then by the largest figure over its limit."""
    rows = make_rows(
        {
            "left": LEFT,
            "far": {**LEFT, "outcome_figure": 0.2},
            "fast": SPEED,
            "faster": {**SPEED, "velocity_peak_ratio": 90.0},
            "hit": {
                "outcome": "collided",
                "outcome_reason": "distance [m] below its margin",
                "outcome_figure": 0.002,
            },
            "never": {
                "outcome": "unfinished",
                "outcome_reason": "tolerance [m] at which 90% of the path are done",
                "outcome_figure": inf,
            },
        }
    )
    found = told(rows)
    order = ["hit", "faster", "fast", "far", "left", "never"]
    assert [case["formulation"] for case in found] == order
    assert found[0]["at most"] == "1 mm"
    assert found[-1]["figure"] == "none does"


def test_the_trial_that_is_shown_is_the_one_of_the_row() -> None:
    """Reference, seed and plant of the worst of several, by which it can be run again."""
    rows = pd.concat(
        [
            make_rows({"a": LEFT}, seeds=(0, 3), plant=plant, reference=reference)
            for plant in ("ideal", "saturating") for reference in ("time", "path")
        ]
    ).reset_index(drop=True)  # fmt: skip
    worst = rows["plant"].eq("ideal") & rows["reference"].eq("path") & rows["seed"].eq(3)
    rows.loc[worst, "outcome_figure"] = 0.5
    (case,) = told(rows)
    assert [case[name] for name in ("reference", "seed", "plant")] == ["path", 3, "ideal"]
    assert case["figure"] == "500 mm"
    assert case["trials"] == 4


@pytest.mark.parametrize("laws", [3, CASES + 5])
def test_no_formulation_is_crowded_out_by_those_that_fail_worse(laws: int) -> None:
    """Each with its worst case at least; formulations take turns, and solvers are one of it."""
    scenarios = [f"reach[distance=0.{number + 1}]" for number in range(6)]
    law: dict[str | tuple[str, str], Values] = {f"reckless{k}": SPEED for k in range(laws)}
    law |= {("qp", f"solver{k}"): SPEED for k in range(30)}
    rows = make_rows({**law, "careful": LEFT}, scenarios)
    shown = [str(case["formulation"]).split(",")[0] for case in told(rows)]
    assert shown.count("careful") == (3 if laws == 3 else 1)
    assert shown[-1] == "careful"
    assert set(shown) == {"qp", "careful", *(f"reckless{k}" for k in range(laws))}
    assert len(shown) == max(CASES, laws + 2)


def test_a_joint_outside_is_told_as_an_angle_and_as_a_length() -> None:
    """Its row does not say whether it turns; where it started outside, the start is no fault."""
    outside = {
        "outcome": "limit-broken",
        "outcome_reason": "distance [rad or m] of a joint outside its range",
        "outcome_figure": 0.01,
        "position_violation_max_rad": 0.2,
    }
    (a,) = told(make_rows({"a": outside}))
    (b,) = told(make_rows({"a": {**outside, "situation": "start outside"}}))
    assert a["figure"] == b["figure"] == b["largest"] == f"{degrees(0.01):.3g} deg or 10 mm"
    assert a["largest"] == f"{degrees(0.2):.3g} deg or 200 mm"


@pytest.mark.parametrize(
    ("extent", "most"), [(1.0, "50 mm"), (0.1, "25 mm")], ids=["ten tolerances", "a quarter"]
)
def test_who_does_not_come_back_is_held_against_the_bound_of_recovery(
    extent: float, most: str
) -> None:
    """10 tolerances or a quarter of the path's extent; at the end the tolerance itself."""
    lost = {
        "outcome": "not-recovered",
        "feasible": "path",
        "outcome_reason": "position",
        "outcome_figure": 0.3,
        "path_extent_m": extent,
        "contour_error_6d_max_m": 0.3,
    }
    at_end = {**lost, "outcome_reason": "distance [m] from the target at the end"}
    rows = make_rows({"a": lost, "b": at_end})
    limits = {case["formulation"]: case["at most"] for case in told(rows)}
    assert limits == {"a": most, "b": "5 mm"}


def test_what_did_not_run_is_told_with_its_message_whatever_is_known_of_its_scenario() -> None:
    """Other trials of scenarios that nothing is known to do come last, and do not count."""
    broke_off = {
        "status": "crashed", "message": "the worker ended | with exit code -11",
        "outcome": "did-not-run", "outcome_step": nan, "steps": 0, "feasible": "",
    }  # fmt: skip
    unknown = {**LEFT, "feasible": "unknown"}
    (case,) = told(make_rows({"a": broke_off}))
    assert case["what"] == broke_off["message"]
    assert case["at step"] == case["figure"] == case["at most"] == ""
    rows = make_rows({"a": unknown, "b": {}})
    (case,) = told(rows)
    assert case["outcome"] == "left-path (does not count)"
    assert failures(rows).note.startswith(
        "None of 0 trials that count failed, and 1 of 2 of scenarios of which no motion is known"
    )
    fast = {**SPEED, "feasible": "no"}
    both = make_rows(
        {"a": {name: [fast[name], LEFT.get(name, fast[name])] for name in fast}},
        ("reach[distance=0.1]", "reach"),
    )
    both.loc[both["scenario"] == "reach", "feasible"] = "time"
    assert [case["outcome"] for case in told(both)] == [
        "left-path", "limit-broken (does not count)",
    ]  # fmt: skip


@settings(max_examples=15)
@given(
    counts=st.lists(st.integers(0, 12), min_size=1, max_size=20),
    seeds=st.integers(1, 2),
)
def test_a_readable_number_is_shown_and_the_rest_is_counted(counts: list[int], seeds: int) -> None:
    """Of each formulation its worst; seeds of a scenario are one case with a count."""
    scenarios = [f"reach[distance=0.{number + 1}]" for number in range(12)]
    rows = make_rows(
        {
            f"law{k}": {
                "outcome": ["left-path"] * count + ["success"] * (12 - count),
                "outcome_reason": "position",
                "outcome_figure": [0.01 * (1 + n) for n in range(12)],
            }
            for k, count in enumerate(counts)
        },
        scenarios,
        tuple(range(seeds)),
    )
    found = failures(rows)
    shown = min(CASES, sum(min(CASES_OF_EACH, count) for count in counts))
    assert len(found.cases) == shown
    assert set(found.cases.get("formulation", [])) == {
        f"law{k}" for k, count in enumerate(counts) if count
    }
    if not sum(counts):
        assert found.note == f"None of {len(rows)} trials that count failed."
        return
    assert found.note.startswith(f"{seeds * sum(counts)} of {len(rows)} trials that count failed.")
    left_out = sum(counts) - shown
    assert (f"{left_out} more case" in found.note) == (left_out > 0)
    assert "trials.csv" in found.note
    assert (found.cases["trials"] == seeds).all()
    for _, own in found.cases.groupby("formulation"):
        assert len(own) <= CASES_OF_EACH


@settings(max_examples=40)
@given(
    by_clock=st.booleans(),
    feasible=st.sampled_from(["time", "path"]),
    figures=st.lists(st.floats(0.0, 1.0), min_size=4, max_size=4),
)
def test_every_reason_of_a_judgement_is_known(
    by_clock: bool, feasible: str, figures: list[float]
) -> None:
    """What decides an outcome has words and a limit that it is beyond."""
    away, end, done, late = figures
    row = {
        "decided_before": "", "reference": "time" if by_clock else "path", "judged_by_path": 1.0,
        "feasible": feasible, "contour_error_6d_max_m": away, "tracking_error_6d_final_m": end,
        "path_done_99_tolerance_m": done, "path_done_90_tolerance_m": done,
        "lag_tolerance_m": late, "path_extent_m": 0.4, "chatters": 0.0, "holds": 0.0,
    }  # fmt: skip
    judged = Judgement.of_row(row)
    verdict = judged.at(0.005)
    if verdict.outcome in (Outcome.SUCCESS, Outcome.RECOVERED):
        return
    # Made of a row, a judgement does not know the words of its distances.
    reason = verdict.reason or ("position" if verdict.figure == away else "")
    if not reason:
        return
    assert reason in QUANTITIES
    columns = {**judged.columns(0.005), "outcome_reason": reason}
    (case,) = told(make_rows({"a": {**columns, **row}}).assign(plant="ideal"))
    if verdict.figure > 1e-3:
        figure, most = (float(str(case[name]).split()[0]) for name in ("figure", "at most"))
        assert figure >= most


def test_every_broken_limit_is_known() -> None:
    """Those of joints and of distances, as they are found along a motion."""
    robot = load_robot("planar3r").with_limits(acceleration=1.0)
    q = np.array([robot.q0, robot.q0])
    still, fast, outside = np.zeros((1, 3)), np.full((1, 3), 50.0), q + 100.0
    inside = np.zeros(2, dtype=bool)
    found: list[Violation | None] = [
        collision(np.array([-1.0])),
        broken_limit(robot, q, inside, fast, still, np.empty(0)),
        broken_limit(robot, q, inside, still, fast, np.empty(0)),
        broken_limit(robot, q, inside, still, still, np.array([2.0])),
        broken_limit(
            load_robot("panda"), np.array([load_robot("panda").q0, outside[0, 0] + np.zeros(7)]),
            inside, np.zeros((1, 7)), np.zeros((1, 7)), np.empty(0),
        ),
    ]  # fmt: skip
    reasons = [violation.reason for violation in found if violation is not None]
    assert len(set(reasons)) == 5
    assert set(reasons) <= set(QUANTITIES)
