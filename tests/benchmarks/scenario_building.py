"""How long a scenario takes to build, certificate included: every family on every robot it lists.

    python tests/benchmarks/scenario_building.py

Prints the median of five builds each, the slowest first, once the robot is loaded; and how long the
first build in a process takes, with the robot.
"""

from __future__ import annotations

from statistics import median
from time import perf_counter

from dikbench.errors import DikbenchError
from dikbench.plugins.building import make_scenario
from dikbench.plugins.finding import plugins
from dikbench.scenario.family import certified_robots

BUILDS = 5


def build(selector: str) -> float:
    """Seconds that a build takes."""
    start = perf_counter()
    make_scenario(selector)
    return perf_counter() - start


def main() -> None:
    """Print the table."""
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


if __name__ == "__main__":
    main()
