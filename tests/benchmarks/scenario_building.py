"""How long a scenario takes to build, certificate included: every family on every robot it lists.

    python tests/benchmarks/scenario_building.py [--together]

Prints the median of five builds each, the slowest first, once the robot is loaded; and how long the
first build in a process takes, with the robot. Then, or with `--together` only, what 250 near
misses of the Panda take of the processor, built alone and together in turns.
"""

from __future__ import annotations

import sys
from statistics import median
from time import perf_counter, process_time

import numpy as np

from dikbench.errors import DikbenchError
from dikbench.plugins.building import make_scenario
from dikbench.plugins.building_together import Cell, make_scenarios
from dikbench.plugins.finding import plugins
from dikbench.scenario.family import certified_robots

BUILDS = 5

TOGETHER = 250
"""Scenarios that are built together ..."""

ALONE = 25
"""... and, in the same turn, alone."""


def build(selector: str) -> float:
    """Seconds that a build takes."""
    start = perf_counter()
    make_scenario(selector)
    return perf_counter() - start


def near_misses() -> list[Cell]:
    """Near misses of the Panda's elbow at different distances, speeds and seeds."""
    random = np.random.default_rng(1)
    return [
        (
            f"near-miss[robot=panda,miss={random.uniform(0.004, 0.04):.4g},"
            f"speed={random.uniform(0.22, 0.28):.4g}]",
            int(random.integers(1, 500)),
        )
        for _ in range(TOGETHER)
    ]


def print_together() -> None:
    """Print processor time per scenario, built alone and together in turns, and their ratio."""
    cells = near_misses()
    make_scenario(*cells[0])
    single, joint = [], []
    for turn in range(BUILDS):
        start = process_time()
        for cell in cells[turn * ALONE : (turn + 1) * ALONE]:
            make_scenario(*cell)
        between = process_time()
        assert len(list(make_scenarios(cells))) == TOGETHER
        single.append((between - start) / ALONE)
        joint.append((process_time() - between) / TOGETHER)
    ratios = [b / a for a, b in zip(single, joint, strict=True)]
    print(
        f"a near miss of the Panda: {1e3 * median(single):.1f} ms alone, "
        f"{1e3 * median(joint):.1f} ms among {TOGETHER} built together; ratio in turns: "
        f"{median(ratios):.2f} ({min(ratios):.2f} to {max(ratios):.2f})"
    )


def print_families() -> None:
    """Print the table of families and robots."""
    rows = []
    for name, family in plugins("scenario").items():
        required = [p for p in family.parameters.values() if p.required]
        if required:
            print(f"{name}: not timed, {required[0].name} must be given")
            continue
        for robot in certified_robots(family.factory):
            for more in ("", ",dt=0.001"):
                selector = f"{name}[robot={robot}{more}]"
                try:
                    first = build(selector)
                    rows.append((median(build(selector) for _ in range(BUILDS)), first, selector))
                except DikbenchError as error:
                    print(f"{selector}: {error}")
    print(f"{'median [ms]':>12} {'first [ms]':>12}")
    for again, first, selector in sorted(rows, reverse=True):
        print(f"{1e3 * again:12.1f} {1e3 * first:12.1f}  {selector}")


def main() -> None:
    """Print both, or the second."""
    if "--together" not in sys.argv[1:]:
        print_families()
    print_together()


if __name__ == "__main__":
    main()
