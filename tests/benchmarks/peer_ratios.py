"""Whole ticks, ours over each peer's, with the peers' versions: part of `make benchmark`.

    python tests/benchmarks/peer_ratios.py [--rounds N]

A tick of ours is what a trial does: kinematics, box, program, solver, integration, recording. One
of Pink, of mink and of Drake's function is the loop that their users would write; of the others it
is their kinematics and their answer alone, along the same motion. A figure is the median over
interleaved rounds of the ratio within each round, on one core and one thread.
"""

from __future__ import annotations

import os

for _name in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"):
    os.environ[_name] = "1"  # before numpy is imported

import argparse
import gc
import importlib.metadata
import statistics
import warnings
from collections.abc import Callable
from typing import Any

from peer_ticks import Tick, drake_tick, mink_tick, pink_tick
from ratios import SCENARIO, WARM, medians, our_tick, without_secondary_tasks

from dikbench.plugins.building import make_formulation, make_scenario
from dikbench.problem.problem import not_installed, program_of
from dikbench.run.timing import record_problems
from dikbench.scenario import Scenario
from dikbench.solvers.checked_solve import make_solve

PROBLEMS = 300
OURS_BESIDE: dict[str, tuple[str, str, Callable[[Scenario], Tick] | None]] = {
    "Pink, qp": ("peer-pink", "qp", pink_tick),
    "mink, qp": ("peer-mink", "qp", mink_tick),
    "Drake's function, qp": ("peer-drake", "qp", drake_tick),
    "Pink": ("peer-pink[limits=ours]", "", None),
    "mink": ("peer-mink[limits=ours]", "", None),
    "Drake's function": ("peer-drake[limits=ours]", "", None),
    "Drake's system": ("peer-drake-system[limits=ours]", "", None),
    "EmbodiK": ("peer-embodik[limits=ours,damping=ours]", "", None),
    "J-PARSE": ("peer-jparse", "", None),
}
"""By name: the peer, our law (default: its counterpart) and its users' loop, where there is one."""


def answering(scenario: Scenario, peer: Any) -> Tick:
    """A peer's kinematics and answer at the control steps of a run."""
    problems = record_problems(scenario, make_formulation("dls"), PROBLEMS)
    solve = make_solve(None, None)

    def run() -> int:
        for problem in problems:
            peer.velocity(problem, solve)
        return len(problems)

    return run


def main() -> None:
    """Measure and print."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--rounds", type=int, default=10, help="measured rounds (default: 10)")
    rounds = parser.parse_args().rounds
    warnings.simplefilter("ignore")
    if hasattr(os, "sched_setaffinity"):
        os.sched_setaffinity(0, {max(os.sched_getaffinity(0))})
    scenario = make_scenario(SCENARIO, 0)
    pose_alone = without_secondary_tasks(scenario)
    ticks: dict[str, Tick] = {}
    pairs: dict[str, tuple[str, str]] = {}
    for name, (selector, law, loop) in OURS_BESIDE.items():
        peer: Any = make_formulation(selector)
        if missing := not_installed(peer):
            print(f"{name} is left out: {missing}")
            continue
        case = scenario if loop in (pink_tick, mink_tick) else pose_alone
        law = law or peer.counterpart
        ours = f"{law.partition('[')[0]}, {'pose and posture' if case is scenario else 'pose'}"
        solver = WARM if program_of(make_formulation(law)) else None
        ticks.setdefault(ours, our_tick(case, law, solver))
        ticks[name] = answering(case, peer) if loop is None else loop(case)
        pairs[name] = ours, f"{peer.package} {importlib.metadata.version(peer.package)}"
    gc.disable()
    samples = medians(ticks, rounds)
    print(f"{'peer':22}{'version':24}{'our law':24}{'ours us':>8}{'theirs':>8}{'ratio':>7}  spread")
    for name, (ours, version) in pairs.items():
        ratios = [a / b for a, b in zip(samples[ours], samples[name], strict=True)]
        left, right = (1e6 * statistics.median(samples[each]) for each in (ours, name))
        print(
            f"{name:22}{version:24}{ours:24}{left:8.0f}{right:8.0f}"
            f"{statistics.median(ratios):7.2f}  {min(ratios):.2f}-{max(ratios):.2f}"
        )


if __name__ == "__main__":
    main()
