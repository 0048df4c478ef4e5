"""How fast the harness is, as ratios within one run: `make benchmark`, or with `--json`.

Every figure is a ratio of medians over interleaved rounds on one core and one thread, garbage
collection off. Nothing else should run meanwhile: look at the spread that is printed beside it.
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
import sys
import tempfile
import warnings
from collections.abc import Callable, Mapping
from math import exp, log
from pathlib import Path
from time import perf_counter

import numpy as np
import pinocchio as pin
from peer_ticks import bare_dls_tick, drake_tick, mink_tick, pink_tick

from dikbench.metrics import evaluate, motion_of
from dikbench.plugins.building import make_formulation, make_scenario
from dikbench.problem import DikProblem, program_of
from dikbench.problem.tasks import PostureTask
from dikbench.robots.limits import JointLimits
from dikbench.robots.planar_arm import planar_arm
from dikbench.robots.robot import Robot, model_limits
from dikbench.run.timing import record_problems
from dikbench.run.trial_row import run_trial
from dikbench.scenario import Scenario
from dikbench.scenario.building import start_velocity
from dikbench.scenario.plant import Ideal
from dikbench.scenario.reference.curves import circle
from dikbench.simulation.closed_loop import simulate
from dikbench.solvers.catalogue.back_ends import parse_solver
from dikbench.solvers.checked_solve import make_solve
from dikbench.study.trial import Trial

SCENARIO = "speed-sweep[robot=panda,speed=0.7,laps=3]"
WARM = "daqp[interface=warm]"
COMPARED = ("osqp", "clarabel", "piqp", "proxqp", "daqp")
HARNESS_MIX = (("dls", "none"), ("qp", WARM), ("lp-alpha", WARM))
HARNESS_SCENARIO = "speed-sweep[robot=panda,speed=0.33,laps=3]"

BARS = {
    "qp_over_pink": (0.30, 0.20),
    "qp_over_mink": (0.25, 0.15),
    "qp_over_drake": (0.5, 0.25),
    "dls_over_numpy": (1.3, 0.8),
    "lp_over_cvxpy": (1 / 20, 1 / 50),
    "warm_over_cold": (1 / 2, 1 / 4),
    "harness": (1.4, 1.25),
    "growth_7_to_30": (4.0, 2.5),
    "evaluate_over_run": (0.4, 0.2),
}
"""What each ratio must reach, and what it could."""

Tick = Callable[[], int]
"""Runs a loop over the scenario and says how many ticks it made."""


def our_tick(scenario: Scenario, law: str, solver: str | None) -> Tick:
    """Kinematics, box, program, solver, integration and recording, as a trial runs them."""
    formulation = make_formulation(law)
    program = program_of(formulation)

    def run() -> int:
        solve = make_solve(parse_solver(solver) if solver else None, program, checks=False)
        return simulate(scenario, formulation, solve, Ideal()).trace.steps

    return run


def without_secondary_tasks(scenario: Scenario) -> Scenario:
    """The same scenario, the pose alone."""
    return Scenario(
        scenario.robot,
        scenario.q0,
        scenario.v0,
        scenario.reference,
        scenario.tracking,
        scenario.dt,
        scenario.duration,
        scenario.certificate,
    )


def planar_scenario(joints: int, like: Scenario) -> Scenario:
    """A circle for a planar arm of so many equal links, 1.5 m long in all, with a posture task."""
    model = planar_arm((1.5 / joints,) * joints, velocity_limits=(2.0,) * joints)
    q0 = np.full(joints, 1.2 / joints)
    limits: JointLimits = model_limits(model)
    robot = Robot(model.name, model, "tip", limits, q0, task_rows=(0, 1, 5))
    data = model.createData()
    pin.forwardKinematics(model, data, q0)
    start = pin.updateFramePlacement(model, data, robot.frame_id).copy()
    turned = pin.SE3(pin.utils.rotate("y", np.pi / 2), np.zeros(3))  # the circle into x-y
    upright = circle(pin.SE3.Identity(), 0.1, 3.0, 2.0)
    moved = type(upright)(
        upright.duration,
        lambda tau: pin.SE3(
            start.rotation, start.translation + turned.rotation @ upright.placement(tau).translation
        ),
        lambda tau: np.concatenate(
            [start.rotation.T @ turned.rotation @ upright.velocity(tau)[:3], np.zeros(3)]
        ),
    )
    return Scenario(
        robot,
        q0,
        start_velocity(robot, moved, q0),
        moved,
        like.tracking,
        like.dt,
        moved.duration,
        like.certificate,
        (PostureTask(target=q0, weight=1e-4),),
    )


def medians(ticks: Mapping[str, Tick], rounds: int) -> dict[str, list[float]]:
    """Time per tick [s] of each contender in every round; the order is shuffled."""
    samples: dict[str, list[float]] = {name: [] for name in ticks}
    shuffle = random.Random(0).shuffle
    order = list(ticks)
    for turn in range(rounds + 1):
        shuffle(order)
        for name in order:
            start = perf_counter()
            count = ticks[name]()
            seconds = (perf_counter() - start) / count
            if turn:  # the first round warms up
                samples[name].append(seconds)
    return samples


def warm_over_cold(problems: list[DikProblem], rounds: int) -> dict[str, list[float]]:
    """Time of one `solve` over contiguous problems, each solver cold and warm [s]."""
    law = make_formulation("qp")
    selectors = [f"{name}[interface={way}]" for name in COMPARED for way in ("cold", "warm")]
    solves = {text: make_solve(parse_solver(text), "qp", checks=False) for text in selectors}
    samples: dict[str, list[float]] = {text: [] for text in selectors}
    shuffle = random.Random(0).shuffle
    for turn in range(rounds + 1):
        shuffle(selectors)
        for text in selectors:
            solve, spent = solves[text], []
            for problem in problems:
                solve.begin_step(0)
                law.velocity(problem, solve)
                spent.append(solve.solve_ns / 1e9)
            if turn:
                samples[text].append(statistics.median(spent))
    return samples


def harness(trials: int) -> list[float]:
    """Wall time of a trial over its time in kinematics, law and solver, summed over the mix."""
    shares = []
    with tempfile.TemporaryDirectory() as folder:
        for number in range(trials + 1):
            wall = control = 0.0
            for law, solver in HARNESS_MIX:
                trial = Trial.of(law, HARNESS_SCENARIO, solver, "ideal", "time", 0)
                row = run_trial(trial, Path(folder) / "trace.arrow")
                wall += row["wall_time_s"]
                control += row["control_time_s"]
            if number:
                shares.append(wall / control)
    return shares


def evaluation(rounds: int) -> list[float]:
    """Time of all metrics over that of the runs that they measure, summed over the mix."""
    scenario, shares = make_scenario(HARNESS_SCENARIO, 0), []
    for number in range(rounds + 1):
        running = measuring = 0.0
        for law, solver in HARNESS_MIX:
            formulation = make_formulation(law)
            program = program_of(formulation)
            solve = make_solve(parse_solver(solver) if program else None, program)
            start = perf_counter()
            run = simulate(scenario, formulation, solve, Ideal())
            between = perf_counter()
            evaluate(motion_of(run.trace, scenario, run.jacobians))
            running += between - start
            measuring += perf_counter() - between
        if number:  # the first round warms up
            shares.append(measuring / running)
    return shares


def ratio_of(samples: Mapping[str, list[float]], ours: str, theirs: str) -> float:
    """Median over rounds of the ratio within each round."""
    return statistics.median(a / b for a, b in zip(samples[ours], samples[theirs], strict=True))


def measure(rounds: int) -> tuple[dict[str, float], dict[str, list[float]]]:
    """Every ratio, and the samples [s] behind them."""
    scenario = make_scenario(SCENARIO, 0)
    pose_alone = without_secondary_tasks(scenario)
    seven, thirty = (planar_scenario(joints, scenario) for joints in (7, 30))
    ticks: dict[str, Tick] = {
        "qp, pose + posture": our_tick(scenario, "qp", WARM),
        "qp, pose": our_tick(pose_alone, "qp", WARM),
        "dls": our_tick(pose_alone, "dls", None),
        "numpy DLS": bare_dls_tick(pose_alone),
        "lp-alpha": our_tick(pose_alone, "lp-alpha", WARM),
        "lp-alpha-cvxpy": our_tick(pose_alone, "lp-alpha-cvxpy", "clarabel"),
        "qp, 7 joints": our_tick(seven, "qp", WARM),
        "qp, 30 joints": our_tick(thirty, "qp", WARM),
    }
    pairs = {
        "qp_over_pink": ("qp, pose + posture", "Pink"),
        "qp_over_mink": ("qp, pose + posture", "mink"),
        "qp_over_drake": ("qp, pose", "Drake"),
        "dls_over_numpy": ("dls", "numpy DLS"),
        "lp_over_cvxpy": ("lp-alpha", "lp-alpha-cvxpy"),
        "growth_7_to_30": ("qp, 30 joints", "qp, 7 joints"),
    }
    peers = {
        "Pink": (pink_tick, scenario),
        "mink": (mink_tick, scenario),
        "Drake": (drake_tick, pose_alone),
    }
    for name, (make_tick, case) in peers.items():
        try:
            ticks[name] = make_tick(case)
        except ImportError as error:
            print(f"{name} is left out: {error} (pip install -e '.[peers,drake]')", file=sys.stderr)
    samples = medians(ticks, rounds)
    ratios = {
        key: ratio_of(samples, ours, theirs)
        for key, (ours, theirs) in pairs.items()
        if theirs in samples
    }
    solves = warm_over_cold(record_problems(scenario, make_formulation("dls"), 300), rounds)
    logs = [log(ratio_of(solves, f"{n}[interface=warm]", f"{n}[interface=cold]")) for n in COMPARED]
    ratios["warm_over_cold"] = exp(statistics.mean(logs))
    ratios["harness"] = statistics.median(harness(4 * rounds))
    ratios["evaluate_over_run"] = statistics.median(evaluation(4 * rounds))
    return {key: ratios[key] for key in BARS if key in ratios}, {**samples, **solves}


def main() -> None:
    """Measure and print."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--json", action="store_true", help="print the ratios for machines")
    parser.add_argument("--rounds", type=int, default=10, help="measured rounds (default: 10)")
    arguments = parser.parse_args()
    warnings.simplefilter("ignore")
    if hasattr(os, "sched_setaffinity"):
        os.sched_setaffinity(0, {max(os.sched_getaffinity(0))})
    gc.disable()
    ratios, samples = measure(arguments.rounds)
    if arguments.json:
        print(json.dumps(ratios))
        return
    print(f"{'time per tick or solve':30}{'median us':>11}{'least':>8}{'most':>8}")
    for name, values in samples.items():
        micro = [1e6 * value for value in values]
        print(f"{name:30}{statistics.median(micro):11.1f}{min(micro):8.1f}{max(micro):8.1f}")
    print(f"\n{'ratio':20}{'measured':>9}{'bar':>8}{'stretch':>9}")
    for key, ratio in ratios.items():
        bar, stretch = BARS[key]
        print(f"{key:20}{ratio:9.3f}{bar:8.3f}{stretch:9.3f}")


if __name__ == "__main__":
    main()
