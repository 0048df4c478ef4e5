"""Rates of success against means by hand; paired intervals; what counts."""

from __future__ import annotations

from typing import Any

import numpy as np
import pandas as pd
import pytest

from dikbench.statistics.success import counted, hierarchical_weights, rates, succeeded, with_facts


def trial(scenario: str, formulation: str = "a", outcome: str = "success", **more: Any) -> Any:
    """A row of a family, a robot, a scenario and a seed: `family.robot.scenario`."""
    family, robot, _ = scenario.split(".")
    return {
        "scenario": scenario,
        "scenario_family": family,
        "robot": robot,
        "seed": 0,
        "formulation": formulation,
        "solver": "none",
        "plant": "ideal",
        "reference": "time",
        "status": "ok",
        "outcome": outcome,
        "feasible": "time",
        "situation": "free space",
        "judged_by_path": 1.0,
        "tolerance_m": 0.005,
        "speed_need": 0.5,
        **more,
    }


def test_a_rate_is_a_mean_of_means_of_means() -> None:
    """Families 1/2 each, robots of the first 1/4, of its robot r scenarios 1/8, seeds 1/16."""
    rows = pd.DataFrame(
        [
            trial("f.r.one", seed=0),
            trial("f.r.one", seed=1, outcome="late"),
            trial("f.r.two", outcome="collided"),
            trial("f.s.one", outcome="recovered"),
            trial("g.r.one", outcome="unfinished"),
        ]
    )
    found = rates(rows, succeeded(rows))
    assert found.rate == pytest.approx([1 / 16 + 0 + 0 + 1 / 4 + 0])
    assert found.trials.tolist() == [5]
    assert hierarchical_weights(rows) == pytest.approx([1 / 16, 1 / 16, 1 / 8, 1 / 4, 1 / 2])


def test_what_counts() -> None:
    """Feasible scenarios alone; targets at rest in both settings; nothing that was skipped."""
    rows = pd.DataFrame(
        [
            trial("f.r.path", reference="path"),
            trial("f.r.time"),
            trial("f.r.rest", judged_by_path=0.0),
            trial("f.r.no", feasible="no"),
            trial("f.r.unknown", feasible="unknown", reference="path"),
            trial("f.r.skipped", status="skipped"),
        ]
    )
    assert counted(rows, "path")["scenario"].tolist() == ["f.r.path", "f.r.rest"]
    assert counted(rows, "time")["scenario"].tolist() == ["f.r.time", "f.r.rest"]


def test_a_trial_that_did_not_run_counts_where_its_scenario_does() -> None:
    """It knows nothing of its scenario: others do."""
    bare = dict.fromkeys(("feasible", "situation", "robot"), "") | {"judged_by_path": np.nan}
    crashed = trial("f.r.x", "b", "did-not-run", status="crashed") | bare
    rows = with_facts(pd.DataFrame([trial("f.r.x", "a"), crashed]))
    found = rates(counted(rows, "time"), succeeded(rows))
    assert found.rate.tolist() == [1.0, 0.0]
    assert found.whole.all()


def _many(rate_b: int, scenarios: int = 60) -> pd.DataFrame:
    names = [f"f{k % 6}.r.{k}" for k in range(scenarios)]
    outcomes = ["success" if k % 10 < rate_b else "late" for k in range(scenarios)]
    return pd.DataFrame(
        [trial(name) for name in names]
        + [trial(name, "b", outcome) for name, outcome in zip(names, outcomes, strict=True)]
        + [trial(name, "oracle") for name in names]
    )


def test_ties_are_ties_and_differences_are_differences() -> None:
    """Half against all is a difference; all against all is none; the oracle does not compete."""
    worse, same = _many(5), _many(10)
    found = rates(worse, succeeded(worse))
    assert found.best.tolist() == [True, False, False]
    assert found.difference[1] == pytest.approx(found.rate[1] - 1)
    assert found.lower[1] < found.difference[1] < found.upper[1] < 0
    assert rates(same, succeeded(same)).best.tolist() == [True, True, False]


def test_who_did_not_run_everything_is_not_the_best() -> None:
    """A rate over the easy half is no rate over all."""
    rows = _many(5)
    easy = rows[(rows["formulation"] != "b") | (rows["outcome"] == "success")]
    found = rates(easy, succeeded(easy))
    assert found.rate[1] == 1
    assert found.best.tolist() == [True, False, False]


def test_nobody_is_best_where_nobody_succeeds() -> None:
    """Equal at zero is no lead."""
    rows = _many(10).assign(outcome="late")
    assert not rates(rows, succeeded(rows)).best.any()
