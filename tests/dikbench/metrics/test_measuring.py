"""What is measured of a run does not depend on what is measured beside it, to the bit."""

from __future__ import annotations

from dataclasses import fields, replace
from functools import cache
from itertools import product
from typing import Any

import numpy as np
import pytest

from dikbench.errors import DikbenchError
from dikbench.metrics import Measured, evaluate, measure, motion_of, outcome_columns
from dikbench.metrics.measuring import STEPS_TOGETHER
from dikbench.plugins.building import make_formulation, make_plant, make_scenario
from dikbench.simulation.clock import ReferenceMode
from dikbench.simulation.closed_loop import simulate
from dikbench.simulation.status import Status
from dikbench.simulation.trace import Trace
from dikbench.solvers.checked_solve import make_solve

SCENARIOS = (
    "near-miss[robot=panda,miss=0.02,speed=0.25,dt=0.02]",
    "near-miss[robot=ur5,miss=0.01,dt=0.02]",
    "task-conflict[dt=0.02]",
    "humanoid[dt=0.02]",
    "step[dt=0.02]",
)
"""Paths of two arms, a second task, held frames, and a target at rest."""


def first_steps(trace: Trace, n: int) -> Trace:
    """The beginning of a trace."""
    arrays = {f.name: getattr(trace, f.name) for f in fields(trace) if f.name not in ("dt", "mode")}
    cut = {name: values[: n + (name in ("q", "tau"))] for name, values in arrays.items()}
    return replace(trace, **cut)


@cache
def runs() -> list[Measured]:
    """Runs of every scenario by both clocks: whole, cut short, shaking, too fast, not finite."""
    found: list[Measured] = []
    for number, name in enumerate(SCENARIOS):
        scenario = make_scenario(name, number)
        modes: list[ReferenceMode] = ["time", "path"] if scenario.reference.moving else ["time"]
        for mode, law in product(modes, ("dls", "dls[damping=0.3]")):
            solve, plant = make_solve(None, None), make_plant("saturating")
            run = simulate(scenario, make_formulation(law), solve, plant, mode)
            trace, n = run.trace, run.trace.steps
            found.append(Measured(trace, scenario, run.jacobians, run.status))
            for k in (0, 1, 2, 3, 40):
                jacobians = run.jacobians[:k] if k % 2 else None
                found.append(Measured(first_steps(trace, k), scenario, jacobians, run.status))
            shaking = trace.applied + 0.3 * (-1.0) ** np.arange(n)[:, None]
            lost = np.where(np.arange(n + 1)[:, None] == n // 2, np.nan, trace.q)
            for other, status in (
                (replace(trace, applied=shaking), Status.OK),
                (replace(trace, applied=1e7 * trace.applied), Status.DIVERGED),
                (replace(trace, q=lost), Status.DIVERGED),
            ):
                found.append(Measured(other, scenario, None, status))
    return found


@cache
def alone() -> list[dict[str, Any]]:
    """What is measured of each by itself."""
    found: list[dict[str, Any]] = []
    for trace, scenario, jacobians, status in runs():
        motion = motion_of(trace, scenario, jacobians) if trace.steps else None
        found.append(
            {} if motion is None else {**evaluate(motion), **outcome_columns(motion, status)}
        )
    return found


def same(found: dict[str, Any], expected: dict[str, Any]) -> bool:
    """Whether two rows are of the same columns and values, to the bit; NaN is NaN."""
    values = zip(found.values(), expected.values(), strict=True)
    return list(found) == list(expected) and all(a == b or (a != a and b != b) for a, b in values)


@pytest.mark.parametrize("seed", range(2))
def test_what_is_measured_of_a_run_does_not_depend_on_the_others(seed: int) -> None:
    """In any order and with any of the others."""
    order = np.random.default_rng(seed).permutation(len(runs()))[seed:]
    together = measure([runs()[number] for number in order])
    for number, found in zip(order.tolist(), together, strict=True):
        assert same(found, alone()[number]), number


def test_the_runs_are_unlike() -> None:
    """Else the above says little: several outcomes, and groups of several runs."""
    assert len({row.get("outcome") for row in alone()}) >= 5
    assert any(row and row["chatter_share"] > 0.5 for row in alone())
    assert {len(row) > 0 for row in alone()} == {True, False}


def test_more_runs_than_are_measured_at_once() -> None:
    """The rows of a group are bounded; every run has its row."""
    number = max(range(len(runs())), key=lambda k: runs()[k].trace.steps)
    many = 2 * STEPS_TOGETHER // runs()[number].trace.steps + 2
    rows = measure([runs()[number]] * many)
    assert len(rows) == many
    assert all(same(row, alone()[number]) for row in rows)


def test_a_trace_of_another_robot_is_one_line() -> None:
    """Also among others of the scenario."""
    panda, ur5 = (next(run for run in runs() if run.scenario.robot.nv == nv) for nv in (7, 6))
    other = ur5._replace(scenario=panda.scenario)
    with pytest.raises(DikbenchError, match=r"trace of another robot: .* \(steps, 7\)$"):
        measure([panda, other])
