"""One formulation against others: every number again, with csv and math alone."""

from __future__ import annotations

import csv
import io
import json
import math
import random
from functools import cache
from pathlib import Path
from typing import Any

import pytest
from click.testing import CliRunner, Result

from dikbench.cli import commands

OUTCOMES = ("success", "left-path", "recovered", "limit-broken")
FAMILIES = {
    "reach": ("panda", "ur5"),
    "speed-sweep": ("panda",),
    "near-miss": ("ur5", "ur10", "panda"),
    "obstacle": ("panda", "ur5"),
}
SITUATIONS = {
    "reach": "free space",
    "speed-sweep": "beyond joint speed",
    "near-miss": "near singularities",
    "obstacle": "obstacles or torques",
}
FORMULATIONS = (
    ("qp", "daqp"),
    ("qp", "osqp"),
    ("dls", "none"),
    ("pinv", "none"),
    ("oracle", "none"),
)

Row = dict[str, Any]


def rows_of_study() -> list[Row]:
    """Rows drawn at random: unequal numbers of robots, scenarios and seeds; ties, gaps, zeros."""
    draw = random.Random(7)
    rows: list[Row] = []
    for family, robots in FAMILIES.items():
        for place, robot in enumerate(robots):
            for number in range(2 + place):
                for seed in range(1 + number):
                    feasible = draw.choice(["time", "path", "time", "no"])
                    for (formulation, solver), often in zip(
                        FORMULATIONS, (0.8, 0.5, 0.3, 0.6, 1.0), strict=True
                    ):
                        for reference in ("time", "path"):
                            done = draw.random() < often
                            rows.append(
                                {
                                    "id": str(len(rows)),
                                    "formulation": formulation,
                                    "solver": solver,
                                    "scenario": f"{family}[robot={robot},distance=0.{number + 1}]",
                                    "plant": "ideal",
                                    "reference": reference,
                                    "seed": seed,
                                    "status": draw.choice(["ok"] * 9 + ["skipped"]),
                                    "message": "",
                                    "steps": 10,
                                    "outcome": draw.choice(
                                        OUTCOMES[::2] if done else OUTCOMES[1::2]
                                    ),
                                    "robot": robot,
                                    "feasible": feasible,
                                    "situation": SITUATIONS[family],
                                    "judged_by_path": 1.0,
                                    "tolerance_m": 0.005,
                                    "speed_need": 0.5,
                                    "contour_error_6d_max_m": draw.choice(
                                        [0.0, 1e-7, 1e-3, draw.uniform(1e-4, 5e-3)]
                                    ),
                                    "slow_down": draw.uniform(1, 3) if reference == "path" else "",
                                    "sees_constraints": int(formulation != "dls")
                                    if family == "obstacle"
                                    else "",
                                }
                            )
    return rows


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A results folder of these rows, without a store."""
    path = tmp_path_factory.mktemp("study")
    rows = rows_of_study()
    with (path / "trials.csv").open("w", newline="") as file:
        writer = csv.DictWriter(file, list(rows[0]))
        writer.writeheader()
        writer.writerows(rows)
    (path / "manifest.json").write_text(json.dumps({"study": {"name": "made up"}}))
    return path


@cache
def dikbench(*arguments: object) -> Result:
    """`dikbench compare` with the arguments; it only reads, but for files that are asked for."""
    return CliRunner().invoke(commands, ["compare", *map(str, arguments)])


def pairs_of(folder: Path, *formulations: str) -> list[Row]:
    """The rows that it prints as CSV."""
    options = [text for name in formulations for text in ("--formulation", name)]
    result = dikbench(folder, *options, "--format", "csv")
    assert result.exit_code == 0, result.output
    return list(csv.DictReader(io.StringIO(result.output)))


def cases_of(folder: Path, pair: Row) -> list[tuple[Row, Row]]:
    """The rows of A and B of every case that counts for a pair that was printed."""
    with (folder / "trials.csv").open(newline="") as file:
        rows = list(csv.DictReader(file))
    found: dict[str, dict[tuple[str, str], Row]] = {"a": {}, "b": {}}
    for side, cases in found.items():
        formulation, _, solver = pair[side].partition(" with ")
        for row in rows:
            if (
                (row["formulation"], row["solver"]) == (formulation, solver or "none")
                and row["status"] != "skipped"
                and row["feasible"] in ("time", "path")
                and row["reference"] == pair["setting"]
                and pair["situation"]
                in (
                    row["situation"],
                    "all situations",
                    "" if row["situation"].startswith("obstacles") else "kinematic situations",
                )
            ):
                cases[row["scenario"], row["seed"]] = row
    return [(row, found["b"][case]) for case, row in found["a"].items() if case in found["b"]]


def done(row: Row) -> int:
    """Whether the robot did its job."""
    return int(row["outcome"] in ("success", "recovered"))


def weights_of(rows: list[Row]) -> list[float]:
    """The weight of each case in a mean over families of robots of scenarios of seeds."""
    families: dict[str, dict[str, dict[str, int]]] = {}
    for row in rows:
        robots = families.setdefault(row["scenario"].partition("[")[0], {})
        scenarios = robots.setdefault(row["robot"], {})
        scenarios[row["scenario"]] = scenarios.get(row["scenario"], 0) + 1
    found = []
    for row in rows:
        robots = families[row["scenario"].partition("[")[0]]
        scenarios = robots[row["robot"]]
        number = len(families) * len(robots) * len(scenarios) * scenarios[row["scenario"]]
        found.append(1 / number)
    return found


def mean(values: list[float], weights: list[float]) -> float:
    """The weighted mean; NaN of nothing."""
    total = math.fsum(weights)
    return math.fsum(map(lambda v, w: v * w, values, weights)) / total if values else math.nan


def equals(text: str, value: float) -> bool:
    """Whether what was printed is a number; an empty cell is one that is not defined."""
    if math.isnan(value):
        return text == ""
    return math.isclose(float(text), value, rel_tol=1e-9, abs_tol=1e-12)


def signed_ranks(values: list[float]) -> float:
    """The matched-pairs rank-biserial correlation, by counting."""
    apart = [value for value in values if value]
    if not apart:
        return math.nan
    ranks = [
        sum(abs(o) < abs(v) for o in apart) + (sum(abs(o) == abs(v) for o in apart) + 1) / 2
        for v in apart
    ]
    return math.fsum(r if v > 0 else -r for v, r in zip(apart, ranks, strict=True)) / math.fsum(
        ranks
    )


def binomial(won: int, lost: int) -> float:
    """The exact two-sided p value of a fair coin."""
    number, least = won + lost, min(won, lost)
    tail = math.fsum(math.comb(number, k) for k in range(least + 1)) / float(2**number)
    return min(1.0, 2 * tail)


def check_success(pair: Row, cases: list[tuple[Row, Row]]) -> None:
    """Rates, difference, won, lost, odds ratio and p value of a pair."""
    weights = weights_of([a for a, _ in cases])
    rate_a = mean([done(a) for a, _ in cases], weights)
    rate_b = mean([done(b) for _, b in cases], weights)
    ahead: dict[str, int] = {}
    for a, b in cases:
        ahead[a["scenario"]] = ahead.get(a["scenario"], 0) + done(a) - done(b)
    won, lost = sum(v > 0 for v in ahead.values()), sum(v < 0 for v in ahead.values())
    assert (int(pair["cases"]), int(pair["scenarios"])) == (len(cases), len(ahead))
    assert (int(pair["only_a"]), int(pair["only_b"])) == (won, lost)
    assert equals(pair["rate_a"], rate_a)
    assert equals(pair["rate_b"], rate_b)
    assert equals(pair["difference"], rate_a - rate_b)
    assert equals(pair["p"], binomial(won, lost))
    ratio = won / lost if lost else math.inf if won else math.nan
    assert equals(pair["odds_ratio"], ratio)


def check_accuracy(pair: Row, cases: list[tuple[Row, Row]]) -> None:
    """Ratios of accuracy and of slow-down where both succeed, and the rank-biserial."""
    common = [(a, b) for a, b in cases if done(a) and done(b)]
    weights = weights_of([a for a, _ in cases])
    kept = [w for (a, b), w in zip(cases, weights, strict=True) if done(a) and done(b)]
    errors = [
        math.log(max(float(a["contour_error_6d_max_m"]), 1e-5))
        - math.log(max(float(b["contour_error_6d_max_m"]), 1e-5))
        for a, b in common
    ]
    assert int(pair["both"]) == len(common)
    assert equals(pair["error_ratio"], math.exp(mean(errors, kept)))
    assert equals(pair["rank_biserial"], signed_ranks([-error for error in errors]))
    if pair["setting"] == "time":
        assert pair["duration_ratio"] == ""
        return
    slower = [math.log(float(a["slow_down"]) / float(b["slow_down"])) for a, b in common]
    assert equals(pair["duration_ratio"], math.exp(mean(slower, kept)))


@pytest.mark.parametrize("names", [("qp with daqp",), ("dls", "pinv"), ("oracle", "dls")])
def test_every_number_again(folder: Path, names: tuple[str, ...]) -> None:
    """All but the intervals, of every setting and situation, against two or all others."""
    pairs = pairs_of(folder, *names)
    assert {pair["setting"] for pair in pairs} == {"path", "time"}
    assert {pair["situation"] for pair in pairs} == {
        *SITUATIONS.values(),
        "all situations",
        "kinematic situations",
    }
    others = {pair["b"] for pair in pairs}
    assert others == {*names[1:]} or others == {"qp with osqp", "dls", "pinv"}
    for pair in pairs:
        if pair["unseen"]:
            continue
        cases = cases_of(folder, pair)
        check_success(pair, cases)
        check_accuracy(pair, cases)


def test_p_values_are_corrected_by_holm(folder: Path) -> None:
    """The k-th smallest of n takes n - k + 1 of its size and no less than the one before."""
    pairs = [pair for pair in pairs_of(folder, "qp with daqp") if not pair["unseen"]]
    for overall in (True, False):
        here = [p for p in pairs if p["situation"].endswith("situations") == overall]
        before = 0.0
        for place, pair in enumerate(sorted(here, key=lambda p: float(p["p"]))):
            before = min(1.0, max(before, float(pair["p"]) * (len(here) - place)))
            assert equals(pair["p_holm"], before)


def test_who_is_not_told_of_obstacles_is_not_compared_there(folder: Path) -> None:
    """And in no number of that situation; over all situations its failures there count."""
    pairs = pairs_of(folder, "qp with daqp", "dls")
    (path, time) = (p for p in pairs if p["situation"] == SITUATIONS["obstacle"])
    assert path["unseen"] == time["unseen"] == "dls not told of them"
    assert path["rate_a"] == path["p"] == path["p_holm"] == ""
    assert (
        "dls not told of them"
        in dikbench(folder, "--formulation", "qp with daqp", "--formulation", "dls").output
    )


def test_intervals_are_those_of_a_bootstrap_by_hand(folder: Path) -> None:
    """Families, in each its scenarios, in each its seeds: drawn with Python's own generator."""
    pairs = pairs_of(folder, "qp with daqp", "pinv")
    (pair,) = (p for p in pairs if (p["situation"], p["setting"]) == ("all situations", "path"))
    cases = cases_of(folder, pair)
    weights = weights_of([a for a, _ in cases])
    tree: dict[str, dict[str, list[int]]] = {}
    for place, (a, _) in enumerate(cases):
        family = tree.setdefault(a["scenario"].partition("[")[0], {})
        family.setdefault(a["scenario"], []).append(place)
    draw, drawn = random.Random(1), []
    for _ in range(3000):
        places = [
            draw.choice(seeds)
            for family in draw.choices(list(tree.values()), k=len(tree))
            for seeds in draw.choices(list(family.values()), k=len(family))
            for _ in seeds
        ]
        differences = [float(done(cases[p][0]) - done(cases[p][1])) for p in places]
        drawn.append(mean(differences, [weights[p] for p in places]))
    drawn.sort()
    assert float(pair["difference_low"]) == pytest.approx(drawn[75], abs=0.05)
    assert float(pair["difference_high"]) == pytest.approx(drawn[2924], abs=0.05)


def test_each_format_has_every_pair(folder: Path, tmp_path: Path) -> None:
    """Text, if not told, Markdown and LaTeX have a row per pair; a file has what was printed."""
    names = ("--formulation", "qp with daqp")
    pairs = pairs_of(folder, "qp with daqp")
    common = sum(pair["both"] not in ("", "0") for pair in pairs)
    marks = {"text": "  ", "markdown": "| ", "latex": " & "}
    for form, mark in marks.items():
        file = tmp_path / form
        named = () if form == "text" else ("--format", form)
        result = dikbench(folder, *names, *named, "--out", file)
        assert result.exit_code == 0
        assert file.read_text() == result.output
        lines = [line for line in result.output.splitlines() if mark in line]
        rows = [line for line in lines if "dls" in line or "pinv" in line or "osqp" in line]
        assert len(rows) == len(pairs) + common
        assert "Holm" in result.output


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (("--formulation", "qp"), "ran with several solvers: name one, as in 'qp with daqp'"),
        (("--formulation", "pin"), "did you mean 'pinv'"),
        (("--formulation", "dls", "--formulation", "dls"), "has no other"),
        (("--formulation", "dls", "--tolerance", "sigma_min=1"), "without --tolerance"),
        (("--formulation", "dls") * 3, "one or two formulations"),
        ((), "two results folders, or one and --formulation"),
        (("--format", "csv"), "two results folders, or one and --formulation"),
    ],
)
def test_what_cannot_be_compared_is_one_line(
    folder: Path, arguments: tuple[str, ...], message: str
) -> None:
    """What is wrong, and what would be valid."""
    result = dikbench(folder, *arguments)
    assert (result.exit_code, result.output.count("\n")) == (2, 1)
    assert message in result.output


def test_rows_without_outcomes_are_refused(folder: Path, tmp_path: Path) -> None:
    """Results of the first release say nothing of success."""
    text = (folder / "trials.csv").read_text().replace("outcome", "was_outcome", 1)
    (tmp_path / "trials.csv").write_text(text)
    (tmp_path / "manifest.json").write_text("{}")
    result = dikbench(tmp_path, "--formulation", "dls")
    assert (result.exit_code, result.output.count("\n")) == (2, 1)
    assert "have no outcomes" in result.output
