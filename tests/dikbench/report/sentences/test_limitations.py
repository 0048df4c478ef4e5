from __future__ import annotations

from typing import Any

import pandas as pd
import pytest
from makers.rows import make_rows

from dikbench.report.sentences.limitations import in_plan, limitations, missing

STUDY: dict[str, Any] = {"study": {"name": "a"}}


def told(rows: pd.DataFrame, manifest: dict[str, Any] = STUDY) -> str:
    """Every sentence of the limitations."""
    found = limitations(rows, manifest, ["A note."])
    return "\n".join(line for each in found for line in (each.text, *each.cases))


def test_each_limitation_is_said_where_it_applies_and_only_there() -> None:
    """A faultless run has none of those that a faulty one has."""
    faults: dict[str, dict[str, Any]] = {
        "1 trial failed": {"status": ["timeout", "ok"], "message": "not finished after 4 s"},
        "1 trial timeout: not finished after 4 s (`a`; on `reach`).": {
            "status": ["timeout", "ok"], "message": "not finished after 4 s",
        },
        "2 cells could not run": {"status": "skipped", "message": "it cannot"},
        "2 cells skipped: it cannot (`a`; on `near-miss` and `reach`).": {
            "status": "skipped",
            "message": "it cannot",
        },
        "`a`: in up to 20 % of a run's steps.": {"not_verified_share": [0.2, 0.0]},
        "2 trials ran in lockstep": {"asked_alone_steps": 0.0, "wall_time_s": float("nan")},
        "workers' time in trials that ran alone": {"asked_alone_steps": [0.0, float("nan")]},
        "without a feasible point": {"infeasible_share": 0.2},
        "Feasible programs without an answer": {"solver_failed_share": 0.2},
        "Acceleration bounds that were given up": {"relaxed_share": 0.2},
        "1 are not stable": {
            "formulation_time_median_us": 1.0, "timing_stability": ["drift: a round", "stable"],
        },
        "`a` on `reach`: drift: a round.": {
            "formulation_time_median_us": 1.0, "timing_stability": ["drift: a round", "stable"],
        },
    }  # fmt: skip
    scenarios = ("reach", "near-miss")
    faultless = told(make_rows({"a": {}, "b": {}}, scenarios))
    for sentence, fault in faults.items():
        assert sentence not in faultless
        assert sentence in told(make_rows({"a": fault, "b": {}}, scenarios)), sentence


def test_one_seed_no_times_and_one_way_of_running_are_said() -> None:
    """More seeds, times and the other plant and reference mode take their sentences away."""
    one = make_rows({"pinv": {}})
    for sentence in (
        "There is one seed (0)", "No timing pass was made: `dikbench time`",
        "moved on with the clock",
        "The plant `saturating`.", "The reference `path`.", "The oracle, a measure", "A note.",
    ):  # fmt: skip
        assert sentence in told(one)
    timed = {"formulation_time_median_us": 1.0, "timing_stability": "stable"}
    more = [
        make_rows({"pinv": timed, "oracle": {}}, seeds=(0, 1), plant=plant, reference=reference)
        for plant in ("ideal", "saturating")
        for reference in ("time", "path")
    ]
    everything = told(pd.concat(more))
    for sentence in (
        "one seed",
        "No timing pass",
        "with the clock",
        "The plant `saturating",
        "The reference `",
    ):
        assert sentence not in everything
    assert "The oracle, a measure" not in everything


def test_what_was_not_run_is_what_is_registered_without_what_was() -> None:
    """A formulation that ran is not listed among those of which nothing is said."""
    text = told(make_rows({"pinv[after=clip]": {}}))
    line = next(line for line in text.split("\n") if " formulations: " in line)
    assert "`dls`" in line
    assert "`pinv`" not in line


def test_trials_that_are_missing_are_counted() -> None:
    """Planned trials without a row are missing; rows that the study does not ask for are others."""
    rows = make_rows({"pinv": {}, ("qp", "daqp"): {}, "dls": {}}, seeds=(0, 1))
    study = {
        "scenarios": ["reach"], "plants": ["ideal"], "references": ["time"], "seeds": [0, 1],
        "cells": [{"formulations": ["pinv", "qp"], "solvers": ["daqp"]}],
    }  # fmt: skip
    manifest = {"study": study, "trials": 7}
    assert in_plan(rows, study).sum() == 4
    assert missing(rows, manifest) == 3
    assert "3 of 7 trials are missing" in told(rows, manifest)
    assert "2 rows of earlier runs" in told(rows, manifest)


def test_lists_begin_with_what_matters_most_whatever_the_order_of_the_rows() -> None:
    """Reasons by how often they occur, shares by their size, names in order of the alphabet."""
    timed = {"formulation_time_median_us": 1.0, "timing_stability": "drift"}
    rows = make_rows(
        {
            "c": {"status": "skipped", "message": "often", **timed},
            "b": {"status": ["ok", "skipped"], "message": ["", "rarely"], "relaxed_share": 0.2},
            "a": {"status": "skipped", "message": "often", "relaxed_share": 0.1, **timed},
            "d": {"relaxed_share": 0.9},
        },
        ("reach", "near-miss"),
    )
    for order in (rows, rows.iloc[::-1]):
        found = {each.text[:4].strip(): each.cases for each in limitations(order, STUDY, [])}
        assert found["5 ce"] == (
            "4 cells skipped: often (`a` and `c`; on `near-miss` and `reach`).",
            "1 cell skipped: rarely (`b`; on `near-miss`).",
        )
        assert [case[:3] for case in found["Acce"]] == ["`d`", "`b`", "`a`"]
        assert [case.split(":")[0] for case in found["Of 4"]] == [
            f"`{name}` on `{scenario}`" for name in "ac" for scenario in ("near-miss", "reach")
        ]


@pytest.mark.parametrize("seed", [5, 0])
def test_the_seed_is_named(seed: int) -> None:
    """Which seed it was stands in the sentence."""
    assert f"There is one seed ({seed})" in told(make_rows({"pinv": {}}, seeds=(seed,)))
