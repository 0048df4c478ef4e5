"""Formulations tried within a budget, with rows that are made up and a clock that is moved."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import Any

import pytest
from makers.rows import FAULTLESS

from dikbench.advice import trying
from dikbench.advice.cases import Cases
from dikbench.advice.contender import contender
from dikbench.advice.needs import Need
from dikbench.advice.trying import FEWEST_CASES, Clock, Tries, candidates, try_all
from dikbench.plugins.drawing import Cell
from dikbench.selector import Selector
from dikbench.study.trial import Trial

NEEDS = [Need("on-path"), Need("limits")]


class Time:
    """A clock that stands still but for what is run."""

    def __init__(self) -> None:
        self.now = 0.0

    def __call__(self) -> float:
        """Return the time [s]."""
        return self.now


class Endless(Cases):
    """Cases for ever, of two families in turn."""

    def __iter__(self) -> Iterator[Cell]:
        """Yield them."""
        for number in range(10_000):
            name = ("near-miss", "step")[number % 2]
            if name not in self.left_out:
                yield Selector(name, {"robot": "ur5", "speed": f"0.{number}"}), number


def tried(
    monkeypatch: pytest.MonkeyPatch,
    budget: float,
    seconds: float,
    reserved: float = 0.0,
    slow_family: str = "",
) -> tuple[Tries, list[Any], float]:
    """Try where each trial takes so long, and laws fail but for `qp` and `sns`."""
    time = Time()
    monkeypatch.setattr(trying, "monotonic", time)

    def evaluate(trials: Sequence[Trial]) -> list[dict[str, Any]]:
        slow = 40 if trials[0].scenario.name == slow_family else 1
        time.now += slow * seconds * len(trials)
        return [
            {
                **FAULTLESS,
                **trial.row,
                "outcome": "success" if trial.formulation.name in ("qp", "sns") else "left-path",
                "contour_error_6d_max_m": 0.0 if trial.formulation.name in ("qp", "sns") else 0.1,
            }
            for trial in trials
        ]

    families = ("near-miss", "step")
    cases = Endless({name: Selector(name) for name in families}, 100)
    found, went_on = try_all(
        cases, candidates(), NEEDS, evaluate, Clock(budget, 0.0), lambda trial: reserved
    )
    return found, went_on, time.now


@pytest.mark.parametrize(("budget", "seconds"), [(180, 0.05), (180, 0.3), (600, 0.1), (60, 0.02)])
def test_the_budget_is_kept_whatever_a_trial_takes(
    monkeypatch: pytest.MonkeyPatch, budget: float, seconds: float
) -> None:
    """It ends where the rest begins, less than a case before and after."""
    found, _, spent = tried(monkeypatch, budget, seconds, reserved=0.2 * budget)
    assert len(found.cases) >= FEWEST_CASES
    assert 0.7 * budget <= spent <= 0.85 * budget


def test_a_slow_machine_takes_from_the_rest_first(monkeypatch: pytest.MonkeyPatch) -> None:
    """Where cases are few they go on, but not to the end."""
    found, _, spent = tried(monkeypatch, 60, 0.3, reserved=50)
    assert 30 < spent <= 60
    assert len(found.cases) < FEWEST_CASES


def test_a_family_that_takes_too_long_has_one_case(monkeypatch: pytest.MonkeyPatch) -> None:
    """The others have the rest of the time."""
    found, _, spent = tried(monkeypatch, 180, 0.03, 40, slow_family="step")
    names = [scenario.name for scenario, _ in found.cases]
    assert names.count("step") == 1
    assert names.count("near-miss") > 10
    assert spent <= 180


def test_whoever_does_best_goes_on_and_runs_every_case(monkeypatch: pytest.MonkeyPatch) -> None:
    """So that rates compare like with like; others ran the first part whole."""
    found, went_on, _ = tried(monkeypatch, 180, 0.1)
    assert {"qp", "sns"} <= {each.formulation.name for each in went_on}
    assert len(went_on) == trying.FINALISTS
    ideal = found.trials[found.trials["plant"].eq("ideal")]
    cases = ideal.groupby("formulation")["seed"].nunique()
    assert cases["qp"] == cases["sns"] == len(found.cases) > found.first_part
    assert cases["pinv"] in (found.first_part, len(found.cases))


def test_what_is_added_goes_on_in_any_case() -> None:
    """A straw law is tried as long as all others."""
    idle = "dikbench/testing/straw.py:Idle"
    assert candidates([idle])[-1] == contender(idle)
    assert len(candidates(["dls", "qp"])) == len(candidates())
