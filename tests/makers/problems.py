"""Makers of control steps, and of what a formulation answers."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from dikbench.arrays import Array
from dikbench.plugins.building import make_formulation
from dikbench.problem import (
    DikProblem,
    Formulation,
    Interval,
    Kinematics,
    Limits,
    LinearizedTask,
    Robot,
    program_of,
)
from dikbench.programs.quadratic_program import QuadraticProgram
from dikbench.robots.catalogue import load_robot
from dikbench.robots.limits import JointLimits
from dikbench.robots.planar_arm import planar_arm
from dikbench.robots.robot import model_limits
from dikbench.solvers.catalogue.back_ends import parse_solver
from dikbench.solvers.checked_solve import CheckedSolve, make_solve


def planar_robot(*lengths: float, velocity: float) -> Robot:
    """A planar arm of links [m], its joints limited in velocity [rad/s], whose task is its tip."""
    model = planar_arm(lengths, velocity_limits=(velocity,) * len(lengths))
    q0 = np.zeros(len(lengths))
    return Robot(f"planar{len(lengths)}r", model, "tip", model_limits(model), q0, (0, 1))


def kinematics_at(robot: Robot, q: Array) -> Kinematics:
    """The kinematics of a robot at a configuration (nq,)."""
    kinematics = Kinematics(robot)
    kinematics.update(q)
    return kinematics


def task_jacobian(robot: Robot, q: Array) -> Array:
    """The Jacobian of the task frame in the rows that the robot can move, computed again."""
    J: Array = kinematics_at(robot, q).jacobian(robot.frame_id)[list(robot.task_rows)]
    return J


def equation(J: Array, V: Array, priority: int = 1) -> LinearizedTask:
    """A task J v = V in numbers, without an error."""
    return LinearizedTask(J, V, np.zeros(len(V)), 1.0, priority)


def equations(*tasks: tuple[Array, Array]) -> list[LinearizedTask]:
    """Tasks J v = V in numbers, one for each priority."""
    return [equation(J, V, priority) for priority, (J, V) in enumerate(tasks, start=1)]


def problem_at(
    robot: Robot,
    q: Array,
    tasks: Sequence[LinearizedTask],
    v_prev: Array | None = None,
    dt: float = 0.01,
) -> DikProblem:
    """A control step at a configuration (nq,), by default without a motion before."""
    return DikProblem(robot, q, v_prev, dt, tasks, robot.limits.at(q))


def problem_of(*tasks: LinearizedTask, robot: str | Robot = "planar3r") -> DikProblem:
    """A control step at the start of a robot with tasks given in numbers.

    For formulations that look at nothing else: J may be of another size than the robot.
    """
    arm = load_robot(robot) if isinstance(robot, str) else robot
    return problem_at(arm, arm.q0, tasks)


def solve_for(formulation: Formulation, solver: str = "daqp") -> CheckedSolve:
    """A solver for a formulation; none where it needs none."""
    program = program_of(formulation)
    return make_solve(None if program is None else parse_solver(solver), program)


def velocity_of(formulation: str | Formulation, problem: DikProblem, solver: str = "daqp") -> Array:
    """What a formulation answers; it may raise `CannotAnswer`."""
    law = make_formulation(formulation) if isinstance(formulation, str) else formulation
    solve = solve_for(law, solver)
    solve.begin_step(0)
    return law.velocity(problem, solve)


class KeepsProgram:
    """A solve that keeps the program it is given."""

    def __init__(self, solver: str = "daqp") -> None:
        self.solve = make_solve(parse_solver(solver), "qp")
        self.program: QuadraticProgram | None = None

    def __call__(self, program: Any) -> Array:
        """See `Solve`."""
        self.program = program
        return self.solve(program)


def limits_at_distances(
    to_lower: object,
    to_upper: object,
    *,
    velocity: object = None,
    acceleration: object = None,
) -> Limits:
    """Limits of joints whose distances to their position limits are given, (nv,)."""
    below, above = (np.atleast_1d(np.asarray(d, float)) for d in (to_lower, to_upper))
    n = len(below)
    joint = JointLimits(
        nv=n,
        q_index=np.arange(n),
        position=Interval(-below, above),
        velocity=_interval(velocity, n),
        acceleration=_interval(acceleration, n),
        effort=None,
    )
    return joint.at(np.zeros(n))


def _interval(value: object, n: int) -> Interval | None:
    """A pair (lower, upper), a symmetric magnitude, or None."""
    if value is None:
        return None
    lower, upper = value if isinstance(value, tuple) else (-np.asarray(value), value)
    return Interval(*(np.broadcast_to(np.asarray(side, float), (n,)) for side in (lower, upper)))
