"""The numbers of a report computed again from trials.csv, with csv and math alone."""

from __future__ import annotations

import csv
import math
import random
from collections import defaultdict
from collections.abc import Callable, Iterable
from pathlib import Path
from statistics import fmean
from typing import Any

Row = dict[str, Any]
Contender = tuple[str, str]

BROKEN = {"did-not-run", "diverged", "collided", "limit-broken"}
DONE = {"success", "recovered"}
FACTS = ("robot", "feasible", "situation", "judged_by_path", "tolerance_m")


def read(path: Path) -> list[Row]:
    """Read a CSV file."""
    with path.open(newline="", encoding="utf-8") as file:
        return list(csv.DictReader(file))


def number(text: str) -> float:
    """Read a number; an empty text is none."""
    return float(text) if text not in ("", None) else math.nan


def defined(values: Iterable[float]) -> list[float]:
    """Leave out what is not a number."""
    return [value for value in values if not math.isnan(value)]


def contender(row: Row) -> Contender:
    """Name formulation and solver."""
    return row["formulation"], row["solver"]


def case(row: Row) -> tuple[str, str]:
    """Name scenario and seed."""
    return row["scenario"], row["seed"]


def family(row: Row) -> str:
    """Name the family of a row's scenario."""
    return str(row["scenario"]).split("[")[0]


def those_that_ran(rows: Iterable[Row]) -> list[Row]:
    """Leave out what was skipped."""
    return [row for row in rows if row["status"] != "skipped"]


def with_facts(rows: list[Row]) -> list[Row]:
    """Give a row what it lacks of its scenario from another one of the same case."""
    known: dict[tuple[str, str], Row] = defaultdict(dict)
    for row in rows:
        for name in FACTS:
            if row[name] != "":
                known[case(row)].setdefault(name, row[name])
    return [{**row, **{name: known[case(row)].get(name, "") for name in FACTS}} for row in rows]


def that_count(rows: list[Row], setting: str) -> list[Row]:
    """Select the trials on the ideal plant that count where the path may wait, or by the clock."""
    found = []
    for row in those_that_ran(with_facts(rows)):
        at_rest = number(row["judged_by_path"]) == 0 and row["reference"] == "time"
        if row["plant"] != "ideal" or row["feasible"] not in ("time", "path"):
            continue
        if row["reference"] == setting or at_rest:
            found.append(row)
    return found


def by_contender(rows: list[Row]) -> dict[Contender, list[Row]]:
    """Group rows by formulation and solver."""
    found: dict[Contender, list[Row]] = defaultdict(list)
    for row in rows:
        found[contender(row)].append(row)
    return found


def rate(rows: list[Row], done: Callable[[Row], bool] | None = None) -> float:
    """Compute the mean over families of means over robots, scenarios and seeds."""
    tree: Any = defaultdict(lambda: defaultdict(lambda: defaultdict(list)))
    for row in rows:
        good = row["outcome"] in DONE if done is None else done(row)
        tree[family(row)][row["robot"]][row["scenario"]].append(float(good))
    return fmean(
        fmean(fmean(fmean(seeds) for seeds in scenarios.values()) for scenarios in robots.values())
        for robots in tree.values()
    )


def whole(rows: list[Row]) -> set[Contender]:
    """Find who ran every case."""
    cases = {case(row) for row in rows}
    return {name for name, of in by_contender(rows).items() if {case(r) for r in of} == cases}


def may_be_first(trials: list[Row], setting: str) -> set[Contender]:
    """Find who may be first in a setting; who is stopped is counted in both."""
    return {name for name, share in successful(trials, setting).items() if share <= 0.05}


def successful(trials: list[Row], setting: str) -> dict[Contender, float]:
    """Find who does more than half of what the best of those that keep limits does.

    Returns:
        The share of the trials of both settings in which each is stopped by what it is told of.
    """
    rows = that_count(trials, setting)
    everywhere = {(case(r), r["reference"], *contender(r)): r
                  for each in ("time", "path") for r in that_count(trials, each)
                  if number(r["judged_by_path"]) != 0}  # fmt: skip
    at_rest = [r for r in that_count(trials, "path") if number(r["judged_by_path"]) == 0]
    all_rows = [*everywhere.values(), *at_rest]
    reached: dict[tuple[str, str], float] = defaultdict(lambda: math.inf)
    for row in rows:
        largest = number(row["tracking_error_6d_max_m"])
        if not math.isnan(largest):
            reached[case(row)] = min(reached[case(row)], largest)
    moving = [
        row
        for row in rows
        if not (
            number(row["judged_by_path"]) == 0 and reached[case(row)] <= number(row["tolerance_m"])
        )
    ]
    rates, shares = {}, {}
    for name in whole(moving) if moving else ():
        own = by_contender(all_rows)[name]
        stopped = [row["outcome"] in BROKEN and number(row["sees_constraints"]) != 0 for row in own]
        if "oracle" not in name[0]:
            rates[name] = rate(by_contender(moving)[name])
            shares[name] = sum(stopped) / len(own)
    best = max((value for name, value in rates.items() if shares[name] <= 0.05), default=0.0)
    return {name: shares[name] for name, value in rates.items() if value > 0.5 * best}


def weights_of(rows: list[Row]) -> dict[tuple[str, str], float]:
    """Weigh cases: families count the same, in each robots, in each scenarios, in each seeds."""
    tree: Any = defaultdict(lambda: defaultdict(lambda: defaultdict(list)))
    for key, row in {case(row): row for row in rows}.items():
        tree[family(row)][row["robot"]][row["scenario"]].append(key)
    return {
        key: 1 / (len(robots) * len(scenarios) * len(seeds))
        for robots in tree.values()
        for scenarios in robots.values()
        for seeds in scenarios.values()
        for key in seeds
    }


def geometric(ratios: dict[tuple[str, str], float], rows: list[Row]) -> float:
    """Compute the geometric mean of ratios of cases, weighed as in a rate."""
    weights = weights_of(rows)
    total = sum(weights[key] * math.log(ratio) for key, ratio in ratios.items())
    return math.exp(total / sum(weights[key] for key in ratios))


def drawn_differences(rows: list[Row], one: Contender, other: Contender) -> list[float]:
    """Draw families, in each robots, in each scenarios, in each seeds, one by one, 2000 times.

    Returns:
        The differences of the rates of one and the other, over the cases of both.
    """
    of = {name: {case(r): r for r in own} for name, own in by_contender(rows).items()}
    weights = weights_of(rows)
    tree: Any = defaultdict(lambda: defaultdict(lambda: defaultdict(list)))
    differences = {}
    for key, row in {case(row): row for row in rows}.items():
        tree[family(row)][row["robot"]][row["scenario"]].append(key)
        pair = (of[one].get(key), of[other].get(key))
        if all(pair):
            values = [float(r["outcome"] in DONE) for r in pair if r]
            differences[key] = values[0] - values[1]
    draw = random.Random(3)
    means = []
    for _ in range(2000):
        total = weight = 0.0
        for robots in draw.choices(list(tree.values()), k=len(tree)):
            for scenarios in draw.choices(list(robots.values()), k=len(robots)):
                for seeds in draw.choices(list(scenarios.values()), k=len(scenarios)):
                    for key in draw.choices(seeds, k=len(seeds)):
                        if key in differences:
                            total += weights[key] * differences[key]
                            weight += weights[key]
        if weight:
            means.append(total / weight)
    return means


def is_quantile(value: float, share: float, drawn: list[float], slack: float = 0.015) -> bool:
    """Say whether a value may be a quantile of a sample, of which many values may be equal."""
    below = sum(each < value - 1e-9 for each in drawn) / len(drawn)
    up_to = sum(each <= value + 1e-9 for each in drawn) / len(drawn)
    return below - slack <= share <= up_to + slack


def outcome_at(row: Row, tolerance: float, *, chatter: bool = True) -> str:
    """Decide the outcome of a trial at a tolerance [m], as section 3 of the verdicts says."""
    if row["decided_before"]:
        return str(row["decided_before"])
    away, end = number(row["contour_error_6d_max_m"]), number(row["tracking_error_6d_final_m"])
    done_99, done_90, in_time = (
        number(row[name])
        for name in (
            "path_done_99_tolerance_m", "path_done_90_tolerance_m", "lag_tolerance_m",
        )
    )  # fmt: skip
    by_clock, found = row["reference"] == "time", ""
    gives_way = by_clock and row["feasible"] == "path" and number(row["judged_by_path"]) == 1
    if gives_way:
        bound = min(10 * tolerance, number(row["path_extent_m"]) / 4)
        if end > tolerance or done_99 > bound or away > bound:
            found = "not-recovered"
    elif number(row["judged_by_path"]) == 0:
        found = "unfinished" if end > tolerance else ""
    elif away > tolerance:
        found = "left-path"
    elif (done_90 if by_clock else done_99) > tolerance:
        found = "unfinished"
    elif by_clock and in_time > tolerance:
        found = "late"
    if not found and chatter and number(row["chatters"]) == 1:
        found = "chattering"
    return found or ("recovered" if gives_way else "success")
