"""The search for the worst case, on rows that nobody ran, and on some that were."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest
from makers.commands import in_process

from dikbench.advice.badness import Badness, badness_of
from dikbench.advice.contender import contender
from dikbench.advice.searched import searched
from dikbench.advice.worst import Search, search_worst
from dikbench.errors import DikbenchError
from dikbench.plugins.building import make_family, scenario_parameters
from dikbench.selector import Selector, parse_selector
from dikbench.study.trial import Trial

IDEAL = Selector("ideal")

FIXED = """
from dataclasses import dataclass
from dikbench.scenario import Case, Family, Perturbation, Robot, Variation

@dataclass(frozen=True, kw_only=True)
class Fixed(Family):
    def case(self, robot, change):
        raise NotImplementedError
"""

Rows = Callable[[Trial], dict[str, Any]]


def made_up(distance: Callable[[dict[str, Any], Trial], float], **others: Any) -> Rows:
    """Make rows whose distance is a function of the scenario's parameters."""

    def row(trial: Trial) -> dict[str, Any]:
        values = dict(scenario_parameters(trial.scenario))
        return {
            **trial.row,
            "status": "ok",
            "message": "",
            "outcome": "success",
            "feasible": "time",
            "judged_by_path": 1.0,
            "contour_error_6d_max_m": distance(values, trial),
            **others,
        }

    return row


def find(scenario: str, row: Rows, *formulations: str, budget: int = 96, seed: int = 0) -> Search:
    """Search with rows that are made up."""

    def evaluate(trials: Sequence[Trial]) -> list[dict[str, Any]]:
        return [row(trial) for trial in trials]

    return search_worst(
        searched(parse_selector(scenario)),
        [contender(name) for name in formulations or ("dls",)],
        evaluate,
        budget=budget,
        seed=seed,
        plant=IDEAL,
        reference="time",
    )


def peak(values: dict[str, Any], trial: Trial) -> float:
    """A distance with one peak: miss 0.01, speed 0.4."""
    away = np.log(values["miss"] / 0.01) ** 2 + np.log(values["speed"] / 0.4) ** 2
    return float(0.1 * np.exp(-away))


def test_the_search_finds_the_peak_of_a_distance() -> None:
    """In 96 cases to a few percent of it, which even spacing misses."""
    found = find("near-miss[robot=ur5,singularity=wrist]", made_up(peak))
    worst = dict(scenario_parameters(found.worst.scenario))
    assert found.worst.badness[0] is not None
    assert found.worst.badness[0].distance > 0.095
    assert worst["miss"] == pytest.approx(0.01, rel=0.3)
    assert worst["speed"] == pytest.approx(0.4, rel=0.3)
    even = [each.badness[0] for each in found.tried[:8]]
    assert max(each.distance for each in even if each) < 0.095


def test_the_budget_is_kept_and_nothing_is_tried_twice() -> None:
    """A case that comes up again is not run again."""
    found = find("near-miss", made_up(peak), budget=64)
    cells = [(each.scenario, each.seed) for each in found.tried]
    assert len(cells) == len(set(cells)) <= 64


def test_the_same_seed_finds_the_same_and_another_tries_others() -> None:
    """The search is a function of its seed."""
    first, again, other = (
        [str(each.scenario) for each in find("near-miss", made_up(peak), seed=seed).tried]
        for seed in (3, 3, 4)
    )
    assert first == again != other


def test_a_broken_limit_is_worse_than_the_farthest_success() -> None:
    """One robot breaks a limit by a hair, all others are a metre away."""

    def row(trial: Trial) -> dict[str, Any]:
        made = made_up(lambda values, trial: 1.0)(trial)
        broken = trial.scenario.parameters["robot"] == "xarm7"
        return (
            {**made, "contour_error_6d_max_m": 1e-4, "outcome": "limit-broken"} if broken else made
        )

    found = find("near-miss", row)
    assert found.worst.scenario.parameters["robot"] == "xarm7"


def test_what_does_not_count_is_never_the_worst() -> None:
    """Cases that nothing can do are passed over, though everything is broken there."""

    def row(trial: Trial) -> dict[str, Any]:
        made = made_up(peak)(trial)
        if float(trial.scenario.parameters["miss"]) < 0.01:
            return {**made, "feasible": "no", "outcome": "limit-broken"}
        return made

    found = find("near-miss[robot=ur5]", row)
    assert 0 < len(found.counted) < len(found.tried)
    assert found.worst in found.counted
    assert float(found.worst.scenario.parameters["miss"]) >= 0.01


def test_where_nothing_counts_the_reason_is_given() -> None:
    """The most frequent one."""
    row = made_up(peak, status="skipped", outcome="", message="there is no such posture")
    with pytest.raises(DikbenchError, match=r"none of .* cases counts.*there is no such posture"):
        find("near-miss", row, budget=16)


def test_against_another_the_difference_counts() -> None:
    """Where both are as bad nothing is said of either."""

    def distance(values: dict[str, Any], trial: Trial) -> float:
        # Both are worst at fast speeds; dls alone is worse than qp at small misses.
        alike = values["speed"]
        return float(alike * (0.002 / values["miss"] if trial.formulation.name == "dls" else 0.01))

    found = find("near-miss[robot=ur5]", made_up(distance), "dls", "qp")
    assert float(found.worst.scenario.parameters["miss"]) < 0.003
    turned = find("near-miss[robot=ur5]", made_up(distance), "qp", "dls")
    assert float(turned.worst.scenario.parameters["miss"]) > 0.03


@pytest.mark.parametrize("family", ["near-miss", "speed-sweep", "hexagon", "random-joint-path"])
def test_every_point_of_a_box_is_a_scenario_in_its_ranges(family: str) -> None:
    """Corners and insides alike, as exact texts; what is given stays."""
    box = searched(parse_selector(family))
    low, high = np.array(box.bounds).T
    random = np.random.default_rng(0)
    points = [low, high, *random.uniform(low, high, (20, len(low)))]
    for point in points:
        whole = np.where(box.whole, np.round(point), point)
        selector, seed = box.cell_at(whole)
        make_family(selector)
        assert parse_selector(str(selector)) == selector
        assert seed == 0 or seed in range(100, 108)


def test_a_selector_that_leaves_nothing_open_is_refused(tmp_path: Path) -> None:
    """In one line."""
    (tmp_path / "fixed.py").write_text(FIXED)
    with pytest.raises(DikbenchError, match="nothing is left to search"):
        searched(parse_selector(f"{tmp_path / 'fixed.py'}:Fixed"))


def test_the_command_leaves_the_case_and_reproduces_it_to_the_bit(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """What is printed runs, in the same folder, and has the numbers of the search."""
    monkeypatch.chdir(tmp_path)
    answer = in_process(
        "worst", "--formulation", "pinv[after=clip]", "--against", "dls",
        "--scenario", "near-miss[robot=ur5,singularity=wrist]",
        "--budget", "8", "--jobs", "1", "--out", "found",
    )  # fmt: skip
    assert answer.exit_code == 0, answer.output
    assert "run again, the same to the bit" in answer.output
    tried: Any = pd.read_csv("found/search.csv").to_dict("records")
    counted = [row for row in tried if row["counts"]]
    first = max(counted, key=lambda row: row["value"])
    stored: Any = pd.read_parquet("found/trials.parquet").to_dict("records")
    assert {row["formulation"] for row in stored} == {"pinv[after=clip]", "dls"}
    for row in stored:
        [own] = [
            each
            for each in counted
            if (each["number"], each["formulation"]) == (first["number"], row["formulation"])
        ]
        assert row["scenario"] == own["scenario"]
        found = badness_of(row)
        assert isinstance(found, Badness)
        assert found.distance == own["distance_m"]
    assert len(list(Path("found/traces").glob("*.arrow"))) == 2


def test_wrong_options_are_one_line() -> None:
    """Before anything runs."""
    for arguments, words in (
        (("--formulation", "dlss", "--scenario", "near-miss"), "dlss"),
        (("--formulation", "dls", "--scenario", "near-mist"), "near-mist"),
        (("--formulation", "dls", "--scenario", "near-miss", "--plant", "soft"), "soft"),
        (("--formulation", "qp", "--scenario", "near-miss", "--solver", "magic"), "magic"),
    ):
        answer = in_process("worst", *arguments)
        assert answer.exit_code == 2
        assert words in answer.output
        assert answer.output.count("\n") == 1


@pytest.mark.long
@pytest.mark.parametrize("reference", ["time", "path"])
@pytest.mark.parametrize(
    ("formulation", "in_grid", "solver"),
    [("pinv", "pinv", "none"), ("dls", "dls[damping=0.05]", "none"), ("qp", "qp", "daqp")],
)
def test_the_search_is_at_least_as_bad_as_the_grid_of_full(
    formulation: str, in_grid: str, solver: str, reference: str, tmp_path: Path
) -> None:
    """Of the committed results, by the same order, within the default budget."""
    trials = pd.read_parquet(Path(__file__).parents[3] / "results/full/trials.parquet")
    trials = trials[
        trials["scenario"].str.startswith("near-miss[")
        & trials["formulation"].eq(in_grid)
        & trials["solver"].eq(solver)
        & trials["plant"].eq("ideal")
        & trials["reference"].eq(reference)
    ]
    rows: Any = trials.to_dict("records")
    grid = [found for row in rows if (found := badness_of(row)) is not None]
    assert len(grid) > 40
    answer = in_process(
        "worst", "--formulation", formulation, "--scenario", "near-miss",
        "--reference", reference, "--out", str(tmp_path / "out"),
    )  # fmt: skip
    assert answer.exit_code == 0, answer.output
    kept: Any = pd.read_parquet(tmp_path / "out" / "trials.parquet").to_dict("records")
    [row] = kept
    found = badness_of(row)
    assert found is not None
    assert found >= max(grid)
