"""Makers of what peers and their counterparts are asked."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pinocchio as pin
import pytest

from dikbench.arrays import Array
from dikbench.plugins.building import make_formulation
from dikbench.problem import DikProblem, PoseTask, PostureTask, Robot
from dikbench.problem.problem import not_installed
from makers.problems import kinematics_at, problem_at

KEPT = np.load(Path(__file__).parents[1] / "data" / "peers" / "random_states.npz")
"""110 states of each of four arms: a third 1 mrad inside a limit, half in motion."""

DT = 0.01


def peer(selector: str) -> Any:
    """Make a peer, or skip the test where it is not installed."""
    made = make_formulation(selector)
    if reason := not_installed(made):
        pytest.skip(reason)
    return made


def states_of(robot: Robot, count: int) -> Iterator[tuple[Array, Array, Array]]:
    """Yield configurations, velocities before and wanted twists; stored ones where there are."""
    if f"{robot.name}/q" in KEPT:
        kept = (KEPT[f"{robot.name}/{key}"][:count] for key in ("q", "v_prev", "V"))
        yield from zip(*kept, strict=True)
        return
    random = np.random.default_rng(3)
    for _ in range(count):
        q = robot.inside(pin.integrate(robot.model, robot.q0, random.uniform(-1, 1, robot.nv)))
        yield q, 0.1 * random.normal(size=robot.nv), random.normal(size=6)


def asked(
    robot: Robot, q: Array, before: Array, V: Array, *, posture: bool = True, moving: bool = False
) -> DikProblem:
    """Make a problem of a pose and perhaps a posture.

    Args:
        robot: the robot.
        q: configuration, (nq,).
        before: velocity before, (nv,).
        V: the twist wanted, (6,), in the task frame's axes; only rows of the robot's count.
        posture: whether there is a posture task of small weight.
        moving: whether the target moves, half of the twist, with a tenth of the other half left.
    """
    kinematics = kinematics_at(robot, q)
    twist = np.zeros(6)
    twist[list(robot.task_rows)] = V[list(robot.task_rows)]
    X = kinematics.placement(robot.frame_id).copy()
    if moving:
        target = X * pin.exp6(pin.Motion(0.1 * twist))
        tasks = [PoseTask(gain=5.0).linearize(kinematics, target, pin.Motion(0.5 * twist))]
    else:
        target = X * pin.exp6(pin.Motion(DT * twist))
        tasks = [PoseTask(target=target, gain=1 / DT).linearize(kinematics)]
    if posture:
        nominal = pin.integrate(robot.model, q, 0.3 * np.cos(np.arange(robot.nv)))
        tasks.append(PostureTask(nominal, gain=1.0, weight=1e-4).linearize(kinematics))
    return problem_at(robot, q, tasks, before, DT)
