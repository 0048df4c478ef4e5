"""Rates of success against means by hand; paired intervals; what counts; who is first."""

from __future__ import annotations

from typing import Any

import numpy as np
import pandas as pd
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from dikbench.report.sentences.findings import leaders
from dikbench.report.sentences.words import Names
from dikbench.statistics.first_places import dependable, first_places, places
from dikbench.statistics.leaving_out import without_each
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


def test_who_does_not_see_what_is_limited_did_not_succeed() -> None:
    """It was skipped there, which is no way to a better rate; other skips do not count."""
    blind = {"status": "skipped", "sees_constraints": 0.0}
    rows = pd.DataFrame(
        [
            trial("obstacle.r.x", "sees"),
            trial("obstacle.r.x", "blind", "does-not-see", **blind),
            trial("obstacle.r.x", "refused", "", status="skipped"),
            trial("reach.r.x", "sees", "late"),
            trial("reach.r.x", "blind"),
            trial("reach.r.x", "refused"),
        ]
    )
    part = counted(with_facts(rows), "time")
    found = rates(part, succeeded(part))
    of = dict(
        zip(found.contenders["formulation"], zip(found.rate, found.whole, strict=True), strict=True)
    )
    assert of["blind"] == (0.5, True)
    assert of["refused"] == (1.0, False)


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


def test_each_resample_is_a_rate_of_drawn_families_robots_and_scenarios() -> None:
    """So its weights add up to one, and with one case per robot of a family robots are drawn."""
    names = ["f.r.1", "f.r.2", "f.s.1", "g.r.1", "g.r.2", "g.r.3", "h.s.1"]
    rows = pd.DataFrame([trial(name, seed=seed) for name in names for seed in (0, 1)])
    assert rates(rows, succeeded(rows)).drawn.sum(axis=1) == pytest.approx(1.0)
    robots = pd.DataFrame([trial(f"f.r{k}.{k}") for k in range(6)])
    others = robots.assign(formulation="b", outcome=["success"] * 3 + ["late"] * 3)
    both = pd.concat([robots, others], ignore_index=True)
    found = rates(both, succeeded(both))
    binomial = np.random.default_rng(0).binomial(6, 0.5, 100_000) / 6 - 1
    assert [found.lower[1], found.upper[1]] == pytest.approx(
        list(np.quantile(binomial, (0.025, 0.975)))
    )


@st.composite
def studies(draw: st.DrawFn) -> pd.DataFrame:
    """Draw a situation of 1 to 9 scenarios, 1 or 2 seeds, and laws of any skill, or of one fault.

    A bad law does a few of the cases alone, whatever they are: one robot, one family, the first.
    """
    places = draw(
        st.lists(
            st.tuples(st.sampled_from("fgh"), st.sampled_from("rst"), st.integers(0, 3)),
            min_size=1, max_size=9, unique=True,
        )
    )  # fmt: skip
    names = [f"{family}.{robot}.{family}{robot}{k}" for family, robot, k in places]
    skills: list[Any] = [lambda *_: True, lambda family, *_: family == "f"]
    skills += [lambda _, robot, __: robot == "r", lambda *place: place == places[0]]
    mask = st.lists(st.booleans(), min_size=len(names), max_size=len(names))
    done = [[skill(*place) for place in places] for skill in skills]
    done += draw(st.lists(mask, min_size=1, max_size=2))
    fault = draw(st.sampled_from(["late", "left-path", "limit-broken", "chattering"]))
    seeds = range(draw(st.integers(1, 2)))
    return pd.DataFrame(
        [
            trial(name, f"law{number}", "success" if good else fault, seed=seed,
                  slow_down=1.0, sees_constraints=np.nan, tracking_error_6d_max_m=0.3)
            for number, of in enumerate(done)
            for name, good in zip(names, of, strict=True)
            for seed in seeds
        ]
    )  # fmt: skip


def _mean_of_means(rows: pd.DataFrame) -> float:
    """A rate by pandas alone."""
    levels = ["scenario_family", "robot", "scenario"]
    done = rows.assign(done=rows["outcome"].eq("success")).groupby(levels)["done"].mean()
    return float(done.groupby(levels[:2]).mean().groupby(levels[0]).mean().mean())


@settings(max_examples=40, deadline=None)
@given(studies())
def test_nobody_far_behind_is_first_and_nobody_on_a_few_cases(rows: pd.DataFrame) -> None:
    """Whatever the sample: within 10 points of the best, in at least 5 scenarios, or not at all."""
    may_be = dependable(rows, rows)
    found = rates(rows, succeeded(rows), may_be)
    first = first_places(rows, found)
    rate = {name: _mean_of_means(part) for name, part in rows.groupby("formulation")}
    best = max((rate[name] for name, _ in may_be), default=0.0)
    named = [str(name) for name in found.contenders["formulation"][first]]
    if rows["scenario"].nunique() < 5:
        assert named == []
    else:
        assert "law0" in named  # the one that does everything
    assert all(rate[name] >= best - 0.1 - 1e-9 for name in named)
    assert all((name, "none") in may_be for name in named)


def test_half_of_the_best_in_a_small_sample_is_not_told_apart_and_not_first() -> None:
    """The interval alone, which families of few robots make wide, would star it."""
    names = [f"{family}.{robot}.{robot}" for family in "fg" for robot in "rst"]
    outcomes = ["success" if name[2] == "r" or name == "f.s.s" else "late" for name in names]
    rows = pd.DataFrame(
        [trial(name, slow_down=1.0) for name in names]
        + [
            trial(name, "b", outcome, slow_down=1.0)
            for name, outcome in zip(names, outcomes, strict=True)
        ]
    )
    found = rates(rows, succeeded(rows))
    assert found.rate.tolist() == pytest.approx([1.0, 0.5])
    assert found.upper[1] >= 0
    assert first_places(rows, found).tolist() == [True, False]


@settings(max_examples=40, deadline=None)
@given(studies())
def test_rates_without_one_are_those_of_the_rows_that_are_left(rows: pd.DataFrame) -> None:
    """Leaving a robot or a family out is the same as not having run it."""
    found = rates(rows, succeeded(rows))
    left_out = list(without_each(rows, found))
    names = found.contenders["formulation"].tolist()
    for each in left_out:
        rest = rows[rows["robot" if each.kind == "robot" else "scenario_family"].ne(each.name)]
        by_hand = [_mean_of_means(rest[rest["formulation"].eq(name)]) for name in names]
        assert each.rate.tolist() == pytest.approx(by_hand)
        assert each.scenarios == rest["scenario"].nunique()
    told = {(each.kind, each.name) for each in left_out}
    for kind, column in (("robot", "robot"), ("family", "scenario_family")):
        values = set(rows[column])
        assert {name for what, name in told if what == kind} == (
            values if len(values) > 1 else set()
        )


def test_who_leads_without_one_robot_is_not_excluded_from_being_first() -> None:
    """All that one law is ahead by is what it does on a single robot."""
    names = [f"f.{robot}.{robot}{number}" for robot in "rst" for number in range(6)]
    ahead = {name: name[2] == "r" or name.endswith("0") for name in names}
    behind = {name: name[2] != "r" and name[-1] in "012" for name in names}
    rows = pd.DataFrame(
        [
            trial(
                name,
                law,
                "success" if done[name] else "late",
                slow_down=1.0,
                sees_constraints=np.nan,
            )
            for law, done in (("a", ahead), ("b", behind))
            for name in names
        ]
    )
    found = rates(rows, succeeded(rows))
    leads = {
        each.name: found.contenders["formulation"][each.leaders(found.whole)].tolist()
        for each in without_each(rows, found)
    }
    assert leads == {"r": ["b"], "s": ["a"], "t": ["a"]}
    rivals = np.ones(2, dtype=bool)
    first, may_lead = places(rows, found, rivals)
    assert first.tolist() == [True, False]
    assert may_lead.tolist() == [True, True]
    leading = leaders(rows, "path", [("a", "none"), ("b", "none")], Names(rows))
    assert leading is not None
    assert not leading.alone
    assert "highest is `b` without the robot r" in leading.finding.text
