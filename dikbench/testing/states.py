"""The control steps on which every formulation is checked: few, seeded and difficult."""

from __future__ import annotations

import pickle
from collections.abc import Iterator, Mapping
from dataclasses import replace
from math import atan, pi
from types import MappingProxyType
from typing import Final, NamedTuple

import numpy as np
import pinocchio as pin

from dikbench.arrays import Array
from dikbench.problem.posing import pose_problem
from dikbench.problem.problem import DikProblem
from dikbench.problem.tasks import PoseTask, PostureTask
from dikbench.problem.velocity_box import velocity_box
from dikbench.robots.kinematics import Kinematics
from dikbench.robots.loading import load_robot
from dikbench.robots.robot import Robot

CONTROL_PERIOD_S: Final = 0.01

_MOTION_BEFORE: Final = (
    (False, "unknown"),
    (True, "on course"),
    (False, "at random"),
    (True, "at random"),
    (True, "unknown"),
)
"""Whether acceleration limits are in force, and the velocity applied before."""

_PANDA_ELBOW = -(atan(0.0825 / 0.316) + atan(0.0825 / 0.384))

SINGULAR: Final[Mapping[str, tuple[tuple[float, ...], ...]]] = MappingProxyType(
    {
        "panda": ((0.2, 0.3, -0.1, _PANDA_ELBOW, 0, 1.6, 0.4), (0.3, 0, pi / 2, -1.8, 0, 1.6, 0.4)),
        "ur5": ((0.3, -1.2, 1.4, -1.7, 0, 0.2), (0.3, -1.2, 0, -1.7, -1.4, 0.2), (0,) * 6),
        "planar3r": ((0.4, 0, 0), (0.4, 0, 0.7)),
    }
)
"""Exactly singular configurations of the robots on which formulations are checked."""


class State(NamedTuple):
    """A control step and its description."""

    label: str
    problem: DikProblem


def states() -> Iterator[State]:
    """Make every state, each of new arrays, so that a formulation cannot change another state.

    Places (inside, about a limit, singular) are crossed with three speeds; acceleration limits, the
    previous velocity, a posture task and rows G v <= h alternate.
    """
    for seed, name in enumerate(SINGULAR):
        known = load_robot(name)
        random = np.random.default_rng(seed)
        limits = pickle.dumps(known.limits)  # copied four times as fast as by `copy.deepcopy`
        count = 0
        for place, q in _configurations(known, random):
            for speed in (0.0, 0.3, 10.0):  # of the frame [m/s]
                # The periods 3, 5 and 2 share no factor: every combination occurs.
                (acceleration, before), posture = _MOTION_BEFORE[count % 5], count // 5 % 2 == 0
                robot = replace(known, limits=pickle.loads(limits), q0=known.q0.copy())
                if acceleration:
                    robot = robot.with_limits(acceleration=known.available_acceleration)
                problem = posed(robot, q, _twist(robot, random, speed), posture=posture)
                problem.v_prev = _velocity_before(problem, before, random)
                rows = count % 4 == 3
                if rows:
                    problem.G, problem.h = _rows(problem, np.random.default_rng([seed, count]))
                label = f"{name}, state {count} ({place}, {speed:g} m/s, v_prev {before}"
                label += ", acceleration limits" if acceleration else ""
                label += ", G v <= h" if rows else ""
                label += ", posture task)" if posture else ")"
                yield State(label, problem)
                count += 1


def _configurations(robot: Robot, random: np.random.Generator) -> Iterator[tuple[str, Array]]:
    """Yield configurations inside the limits, about one limit, and exactly singular."""
    position = robot.limits.position
    assert position is not None
    lower, upper = np.maximum(position.lower, -pi), np.minimum(position.upper, pi)
    for _ in range(5):
        yield "inside the limits", random.uniform(lower, upper)
    for place, outwards, sides in (
        ("1 mrad inside a limit", -1e-3, (-1, 1, -1, 1)),
        ("exactly at a limit", 0.0, (-1, 1, -1, 1)),
        ("1 mrad outside a limit", 1e-3, (-1, 1)),
    ):
        for side in sides:
            q = random.uniform(lower, upper)
            joint = random.integers(robot.nv)
            q[joint] = (position.lower if side < 0 else position.upper)[joint] + side * outwards
            yield place, q
    singular = SINGULAR[robot.name]
    for number in range(3):
        yield "exactly singular", np.array(singular[number % len(singular)], dtype=float)


def _twist(robot: Robot, random: np.random.Generator, speed: float) -> Array:
    """Draw a twist (6,) that the arm can make, its linear part of the given speed [m/s]."""
    direction = np.zeros(6)
    direction[list(robot.task_rows)] = random.normal(size=len(robot.task_rows))
    return speed * direction / float(np.linalg.norm(direction[:3]))


def _velocity_before(problem: DikProblem, before: str, random: np.random.Generator) -> Array | None:
    """Draw the velocity applied last, inside the limits, (nv,) [rad/s]; or None."""
    if before == "unknown":
        return None
    robot, task = problem.robot, problem.tasks[0]
    assert robot.limits.velocity is not None
    assert robot.available_acceleration is not None
    fastest = robot.limits.velocity.upper
    spread = random.uniform(-0.9, 0.9, robot.nv)
    if before == "at random":
        return spread * fastest
    v = np.linalg.pinv(task.J, rcond=1e-6) @ task.V
    v /= max(1.0, 2 * float(np.max(np.abs(v) / fastest)))
    return v + 0.5 * CONTROL_PERIOD_S * spread * robot.available_acceleration


def _rows(problem: DikProblem, random: np.random.Generator) -> tuple[Array, Array]:
    """Draw half-spaces that cut the velocity box and leave some of it, of unit normals."""
    box = velocity_box(problem.limits, problem.v_prev, problem.dt)
    inside = np.clip(np.zeros(problem.robot.nv), box.lower, box.upper)
    G = random.normal(size=(3, problem.robot.nv))
    G /= np.linalg.norm(G, axis=1, keepdims=True)
    return G, G @ inside + random.uniform(0, 0.3, 3)


def posed(robot: Robot, q: Array, twist: Array, *, posture: bool = False) -> DikProblem:
    """Pose the control step in which the frame is to move with a twist to a target."""
    kinematics = Kinematics(robot)
    kinematics.update(q.copy())
    # Less than half a turn away, so that the logarithm gives the twist.
    target = kinematics.placement(robot.frame_id) * pin.exp6(twist * CONTROL_PERIOD_S)
    pose = PoseTask(target=target, gain=1 / CONTROL_PERIOD_S).linearize(kinematics)
    others = [PostureTask(robot.q0, weight=0.01)] if posture else []
    return pose_problem(kinematics, None, CONTROL_PERIOD_S, pose, others)
