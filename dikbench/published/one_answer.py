"""One control step of a published experiment: a task at a configuration, a formulation's answer."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Final

import numpy as np

from dikbench.arrays import Array
from dikbench.errors import CannotAnswer, DikbenchError
from dikbench.plugins.building import make_formulation
from dikbench.problem.constraints import Constraint
from dikbench.problem.posing import pose_problem
from dikbench.problem.problem import not_installed, program_of, refusal_of
from dikbench.problem.tasks import LinearizedTask, Task
from dikbench.published.folder import FOLDER
from dikbench.robots.kinematics import Kinematics
from dikbench.robots.loading import load_robot
from dikbench.robots.robot import Robot
from dikbench.solvers.catalogue.back_ends import DEFAULT_SOLVER, parse_solver
from dikbench.solvers.checked_solve import make_solve

Answer = Callable[..., Array]

EXACT: Final = 1e-9
"""Differences up to this share are rounding."""


def answering(formulation: str, solver: str = "") -> Answer:
    """Return what a formulation's selector answers: (kinematics, dt, task, others, rows) -> v.

    It is NaN where the formulation has no answer. A solver is the default one where none is named.

    Raises:
        DikbenchError: if there is no such formulation, or its package is not installed; by the
            answer, if it refuses the problem.
    """
    law = make_formulation(formulation)
    if missing := not_installed(law):
        raise DikbenchError(missing)
    program = program_of(law)
    text = "" if program is None else solver or DEFAULT_SOLVER[program]
    solve = make_solve(parse_solver(text) if text else None, program)

    def answer(
        kinematics: Kinematics,
        dt: float,
        tracking: LinearizedTask,
        tasks: Sequence[Task] = (),
        constraints: Sequence[Constraint] = (),
    ) -> Array:
        problem = pose_problem(kinematics, None, dt, tracking, tasks, constraints)
        reason = refusal_of(law, problem)
        if reason:
            raise DikbenchError(f"{formulation}: {reason}")
        try:
            return law.velocity(problem, solve)
        except CannotAnswer:
            return np.full(problem.robot.nv, np.nan)

    return answer


def random_configurations(robot: Robot, count: int, random: np.random.Generator) -> Array:
    """Draw configurations uniformly inside the position limits, (count, nq)."""
    position = robot.limits.position
    assert position is not None
    q: Array = random.uniform(position.lower, position.upper, (count, robot.nv))
    return q


def robot_of(name: str, frame: str | None) -> Robot:
    """Load a robot; a URDF by its name alone is one of those beside the experiments."""
    beside = FOLDER / name
    return load_robot(str(beside) if beside.is_file() else name, frame)
