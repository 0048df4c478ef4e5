"""What trials in lockstep cost, as ratios within one run: part of `make benchmark`.

    python tests/benchmarks/lockstep.py [--first COMMIT]

The tick of each formulation in lockstep over that of Pink (FrameTask, daqp), on one core and one
thread; a whole study of 240 more near misses over that of an earlier commit; growth with joints,
trials and cores. Nothing else should run meanwhile.
"""

from __future__ import annotations

import os

for _name in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"):
    os.environ[_name] = "1"  # before numpy is imported

import argparse
import gc
import json
import random
import statistics
import subprocess
import sys
import tempfile
import warnings
from collections.abc import Callable
from pathlib import Path
from time import perf_counter

from peer_ticks import pink_tick
from ratios import planar_scenario

from dikbench.plugins.building import make_formulation, make_scenario
from dikbench.plugins.building_together import make_scenarios
from dikbench.problem import program_of
from dikbench.scenario import Scenario
from dikbench.scenario.plant import Ideal
from dikbench.simulation.closed_loop import simulate
from dikbench.simulation.lockstep import LockstepTrial, simulate_together
from dikbench.solvers.catalogue.back_ends import DEFAULT_SOLVER, parse_solver
from dikbench.solvers.checked_solve import CheckedSolve, make_solve

BARS = {
    "dls": (0.04, 0.02),
    "pinv[after=clip]": (0.05, 0.02),
    "qp": (0.10, 0.06),
    "lp-alpha": (0.12, 0.08),
    "study": (0.20, 0.12),
}
"""What each ratio must reach, and what it could."""

FIRST_RELEASE = "87c9517"
ROWS = 1000
DIFFERENT = 20
"""Scenarios that the rows take turns with."""

ROUNDS = 5
STUDY_SCENARIOS = 240

TIMED_RUN = """
import json, resource, sys
from pathlib import Path
from dikbench.run.runner import run_study
try:
    from dikbench.run.in_workers import RunSettings
    from dikbench.study.study import load_study
except ImportError:  # the first release
    from dikbench.run.runner import RunSettings
    from dikbench.study import load_study

if __name__ == "__main__":
    study, out, jobs = sys.argv[1:]
    run_study(load_study(study), Path(out), RunSettings(jobs=int(jobs), traces="none"), "")
    used = [resource.getrusage(who) for who in (resource.RUSAGE_SELF, resource.RUSAGE_CHILDREN)]
    print(json.dumps({
        "cpu": sum(each.ru_utime + each.ru_stime for each in used),
        "driver_mb": used[0].ru_maxrss / 1024,
    }))
"""


def near_misses(count: int) -> list[str]:
    """Selectors of near misses that differ in distance and speed."""
    draw = random.Random(1).uniform
    return [
        f"near-miss[robot=panda,miss={draw(0.004, 0.04):.5f},speed={draw(0.22, 0.28):.4f}]"
        for _ in range(count)
    ]


def solve_for(law: str) -> CheckedSolve:
    """A fresh default solver, whose answers are rechecked as in a study."""
    program = program_of(make_formulation(law))
    return make_solve(None if program is None else parse_solver(DEFAULT_SOLVER[program]), program)


def lockstep_tick(scenarios: list[Scenario], law: str, rows: int) -> Callable[[], float]:
    """Run rows in lockstep; the time of one control step of one row [s]."""
    formulation = make_formulation(law)

    def run() -> float:
        trials = [
            LockstepTrial(scenarios[k % len(scenarios)], formulation, solve_for(law), 0, True)
            for k in range(rows)
        ]
        start = perf_counter()
        found = simulate_together(trials, Ideal(), "time")
        return (perf_counter() - start) / sum(each.run.trace.steps for each in found)

    return run


def single_tick(scenario: Scenario, law: str) -> Callable[[], float]:
    """Run a trial alone; the time of one control step [s]."""
    formulation = make_formulation(law)

    def run() -> float:
        start = perf_counter()
        made = simulate(scenario, formulation, solve_for(law), Ideal())
        return (perf_counter() - start) / made.trace.steps

    return run


def _timed(pink: Callable[[], int]) -> float:
    start = perf_counter()
    count = pink()
    return (perf_counter() - start) / count


def interleaved(works: dict[str, Callable[[], float]]) -> dict[str, list[float]]:
    """Time everything in turns, after a first round that warms up."""
    samples: dict[str, list[float]] = {name: [] for name in works}
    for turn in range(ROUNDS + 1):
        for name, work in works.items():
            seconds = work()
            if turn:
                samples[name].append(seconds)
    return samples


def line(name: str, ratios: list[float]) -> None:
    """Print a ratio, its spread, and what it must reach."""
    bar = BARS.get(name)
    wanted = "" if bar is None else f"   (must reach {bar[0]:g}, could {bar[1]:g})"
    spread = f"{min(ratios):.3f} to {max(ratios):.3f}"
    print(f"{name:34s} {statistics.median(ratios):7.3f}   {spread}{wanted}", flush=True)


def ticks() -> None:
    """Print ticks in lockstep and alone over Pink's, and how they grow."""
    scenarios = [
        each for each in make_scenarios((s, 1) for s in near_misses(DIFFERENT))
        if isinstance(each, Scenario)
    ]  # fmt: skip
    pink = pink_tick(scenarios[0])

    laws = [law for law in BARS if law != "study"]
    works: dict[str, Callable[[], float]] = {"pink": lambda: _timed(pink)}
    works |= {law: lockstep_tick(scenarios, law, ROWS) for law in laws}
    works |= {f"{law}, alone": single_tick(scenarios[0], law) for law in laws}
    works |= {f"dls, N = {n}": lockstep_tick(scenarios, "dls", n) for n in (10, 100)}
    small = [make_scenario("speed-sweep[robot=panda,speed=0.7,dt=0.02]")]
    for joints in (7, 30):
        arm = [planar_scenario(joints, small[0])]
        works[f"dls, {joints} joints, N = 100"] = lockstep_tick(arm, "dls", 100)
    samples = interleaved(works)
    print(f"control steps over Pink's tick, N = {ROWS}:")
    for name in works:
        if name != "pink":
            line(name, [a / b for a, b in zip(samples[name], samples["pink"], strict=True)])


def study_file(folder: Path, scenarios: list[str]) -> Path:
    """Write a study of four formulations, which every release reads."""
    listed = ",\n".join(f'  "{each}"' for each in scenarios)
    path = folder / f"of_{len(scenarios)}.toml"
    path.write_text(
        f'description = "near misses"\nscenarios = [\n{listed}\n]\nplants = ["ideal"]\n'
        'references = ["time"]\nseeds = [1]\n'
        '[[cells]]\nformulations = ["dls", "pinv[after=clip]"]\n'
        '[[cells]]\nformulations = ["qp", "lp-alpha"]\nsolvers = ["daqp[then=clarabel]"]\n'
    )
    return path


def timed_run(tree: Path, study: Path, jobs: int = 1) -> dict[str, float]:
    """Run a study by the sources of a tree; processor time [s], memory of the driver [MB]."""
    with tempfile.TemporaryDirectory() as folder:
        script = Path(folder) / "timed_run.py"
        script.write_text(TIMED_RUN)
        start = perf_counter()
        done = subprocess.run(
            [sys.executable, str(script), str(study), str(Path(folder) / "out"), str(jobs)],
            env={**os.environ, "PYTHONPATH": str(tree)},
            capture_output=True, text=True, check=False,
        )  # fmt: skip
        if done.returncode:
            sys.exit(f"the study did not run by {tree.name}: {done.stderr.strip()[-400:]}")
        found: dict[str, float] = json.loads(done.stdout.strip().splitlines()[-1])
        return {**found, "wall": perf_counter() - start}


def studies(first: str) -> None:
    """Print the cost of 240 more scenarios over an earlier commit's, and how it grows."""
    here = Path(__file__).resolve().parents[2]
    with tempfile.TemporaryDirectory() as folder:
        earlier = Path(folder) / "earlier"
        made = subprocess.run(
            ["git", "-C", str(here), "worktree", "add", "--detach", "-q", str(earlier), first],
            capture_output=True, text=True, check=False,
        )  # fmt: skip
        if made.returncode:
            print(f"no study of {first}: {made.stderr.strip().splitlines()[-1]}")
            return
        try:
            # The solver that falls back is not in the first release.
            old = {"daqp[then=clarabel]": "daqp"}
            ratios = []
            few, many = (study_file(Path(folder), near_misses(n)) for n in (1, 1 + STUDY_SCENARIOS))
            for _ in range(2):
                ours = timed_run(here, many)["cpu"] - timed_run(here, few)["cpu"]
                for study in (few, many):
                    text = study.read_text()
                    for new, name in old.items():
                        text = text.replace(new, name)
                    study.with_suffix(".old.toml").write_text(text)
                theirs = [
                    timed_run(earlier, study.with_suffix(".old.toml"))["cpu"]
                    for study in (many, few)
                ]
                ratios.append(ours / (theirs[0] - theirs[1]))
            print(f"processor time of {STUDY_SCENARIOS} more scenarios over that of {first}:")
            line("study", ratios)
            more = study_file(Path(folder), near_misses(1 + 5 * STUDY_SCENARIOS))
            one, two = (timed_run(here, more, jobs) for jobs in (1, 2))
            once = timed_run(here, many)
            print(f"five times the trials: {one['cpu'] / once['cpu']:.2f} times the processor time")
            print(
                f"driver: {one['driver_mb'] - once['driver_mb']:+.0f} MB for five times the trials"
            )
            print(f"two workers: {two['wall'] / one['wall']:.2f} of the time of one")
        finally:
            subprocess.run(
                ["git", "-C", str(here), "worktree", "remove", "--force", str(earlier)], check=False
            )


def main() -> None:
    """Print everything."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--first", default=FIRST_RELEASE, help="the commit to compare studies with")
    parser.add_argument("--ticks", action="store_true", help="the ticks alone")
    given = parser.parse_args()
    warnings.simplefilter("ignore")
    gc.disable()
    ticks()
    if not given.ticks:
        studies(given.first)


if __name__ == "__main__":
    main()
