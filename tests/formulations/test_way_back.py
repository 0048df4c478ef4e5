"""The way back from outside a position limit, in closed loop with acceleration limits in force."""

from __future__ import annotations

import numpy as np
import pytest
from makers.problems import solve_for
from makers.turns import in_turns

from dikbench.arrays import Array
from dikbench.plugins.building import make_formulation, make_scenario
from dikbench.plugins.finding import plugins
from dikbench.problem import Kinematics, PoseTask, program_of, promises_of
from dikbench.robots.loading import load_robot
from dikbench.scenario import Certificate, Scenario, target_at_rest
from dikbench.scenario.plant import Ideal
from dikbench.simulation.closed_loop import simulate
from dikbench.solvers.catalogue.back_ends import DEFAULT_SOLVER

ACCELERATION = 2.0
DT = 0.01
NAMES = [
    name
    for name in plugins("formulation")
    if "acceleration" in promises_of(make_formulation(name)) and name != "lp-alpha-cvxpy"
]
"""Who promises to keep them, without `lp-alpha` in other words, which is slow."""

BRAKING_LATE = {"pink-qp", "mink-qp", "drake"}
"""Who brakes by a share of the distance per step, or in one."""


def _held_outside(name: str, outside: Array) -> Scenario:
    """The task is to stay where the start is, `outside` (nv,) [rad] of the limits."""
    robot = load_robot(name).with_limits(acceleration=ACCELERATION)
    position = robot.limits.position
    assert position is not None
    q0 = np.where(outside > 0, position.upper, np.where(outside < 0, position.lower, robot.q0))
    q0 = q0 + outside
    kinematics = Kinematics(robot)
    kinematics.update(q0)
    target = kinematics.placement(robot.frame_id).copy()
    return Scenario(
        robot=robot, q0=q0, v0=np.zeros(robot.nv), reference=target_at_rest(target, 1.0),
        tracking=PoseTask(gain=5.0), dt=DT, duration=1.2, certificate=Certificate(()),
    )  # fmt: skip


OUTSIDE = {
    "planar3r": np.array([0.0, 0.08, 0.0]),
    "panda": np.array([0, -0.1, 0, 0.08, 0, 0.002, 0]),
}


@pytest.mark.parametrize(("name", "robot"), in_turns(NAMES, OUTSIDE))
def test_it_comes_back_and_no_step_breaks_an_acceleration_limit(name: str, robot: str) -> None:
    """Though the task pulls outwards: inside within 1.2 s, never farther out, never too sudden.

    Libraries that brake too late before a limit break acceleration limits there, once inside.
    """
    scenario = _held_outside(robot, OUTSIDE[robot])
    formulation = make_formulation(name)
    solver = DEFAULT_SOLVER[program_of(formulation) or "qp"]
    trace = simulate(scenario, formulation, solve_for(formulation, solver), Ideal()).trace
    position = scenario.robot.limits.position
    assert position is not None
    excess = np.maximum(trace.q - position.upper, position.lower - trace.q)
    change = np.abs(np.diff(np.vstack([scenario.v0, trace.applied]), axis=0))
    counted = excess[:-1] > 1e-9 if name in BRAKING_LATE else np.full(change.shape, True)
    assert change[counted].max() <= ACCELERATION * DT * (1 + 1e-6)
    assert np.diff(np.maximum(excess, 0.0), axis=0).max() <= 1e-9
    assert excess[-1].max() <= 1e-9


def test_the_family_that_starts_outside_keeps_them_too() -> None:
    """Its reference leads back slowly from rest on."""
    scenario = make_scenario("start-outside[robot=ur5,acceleration=true]")
    formulation = make_formulation("qp")
    trace = simulate(scenario, formulation, solve_for(formulation), Ideal()).trace
    limit = scenario.robot.limits.acceleration
    assert limit is not None
    v = np.vstack([scenario.v0, trace.applied])
    assert limit.usage(np.diff(v, axis=0) / scenario.dt).max() <= 1 + 1e-6
