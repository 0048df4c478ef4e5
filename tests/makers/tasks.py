"""Robots at configurations, and the derivatives of the errors of their tasks."""

from __future__ import annotations

import importlib.metadata
from functools import lru_cache

import numpy as np
import pinocchio as pin
import pytest
from hypothesis import strategies as st

from dikbench.arrays import Array
from dikbench.problem.tasks import (
    LinearizedTask,
    Task,
)
from dikbench.robots.loading import load_robot
from dikbench.robots.robot import Robot
from makers.problems import kinematics_at

STEP = 1e-6
TOLERANCE = 1e-5

ROBOTS = ("panda", "ur5", "planar3r")
seeds = st.integers(0, 2**32 - 1)


@lru_cache
def kinova() -> Robot:
    """Load an arm with continuous joints."""
    for file in importlib.metadata.distribution("example-robot-data").files or ():
        if str(file).endswith("kinova_description/robots/kinova.urdf"):
            return load_robot(str(file.locate()), "j2s6s200_end_effector")
    pytest.fail("example-robot-data has no kinova.urdf")


def robot_of(name: str) -> Robot:
    """Load a robot of the catalogue, or the arm with continuous joints."""
    return kinova() if name == "kinova" else load_robot(name)


def random_q(robot: Robot, random: np.random.Generator, spread: float = 2.0) -> Array:
    """Draw a configuration up to `spread` [rad] away from the start, joint by joint."""
    q: Array = pin.integrate(robot.model, robot.q0, random.uniform(-spread, spread, robot.nv))
    return q


def tip_of(robot: Robot, q: Array) -> pin.SE3:
    """Compute the placement of the task frame at a configuration (nq,)."""
    return kinematics_at(robot, q).placement(robot.frame_id).copy()


def error_derivative(robot: Robot, task: Task, q: Array) -> Array:
    """Compute d(error)/dv by central differences, (m, nv)."""
    columns = []
    for joint in range(robot.nv):
        step = np.zeros(robot.nv)
        step[joint] = STEP
        ahead, behind = (
            task.linearize(kinematics_at(robot, pin.integrate(robot.model, q, sign * step))).error
            for sign in (1, -1)
        )
        columns.append((ahead - behind) / (2 * STEP))
    return np.column_stack(columns)


def predicted_derivative(task: LinearizedTask) -> Array:
    """Compute what d(error)/dv must be, -(Jl J), (m, nv)."""
    Jl = task.log_derivative
    return -task.J if Jl is None else -Jl @ task.J
