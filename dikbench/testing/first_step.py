"""Whether the first control step of a scenario can be posed and solved."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from dikbench.arrays import Array
from dikbench.errors import DikbenchError
from dikbench.problem.posing import pose_problem
from dikbench.problem.problem import DikProblem, Solve
from dikbench.programs.quadratic_program import ProgramKind, QuadraticProgram
from dikbench.robots.kinematics import Kinematics
from dikbench.scenario.scenario import Scenario
from dikbench.simulation.control_step import TrialEnded, control_step
from dikbench.simulation.status import Status
from dikbench.solvers.catalogue.back_ends import DEFAULT_SOLVER, parse_solver
from dikbench.solvers.checked_solve import make_solve


@dataclass(frozen=True)
class _LeastSquares:
    """Do the first level as well as the limits and the rows G v <= h allow."""

    program: ClassVar[ProgramKind] = "qp"

    def velocity(self, problem: DikProblem, solve: Solve) -> Array:
        """See `Formulation`."""
        P, p = problem.primary.normal_equations()
        box = problem.box()
        return solve(
            QuadraticProgram(
                P + 1e-6 * np.eye(len(P)), -p, problem.G, problem.h, lb=box.lower, ub=box.upper
            )
        )


def no_first_step(scenario: Scenario) -> Iterator[str]:
    """Pose the first control step, have it solved, and yield why that cannot be done."""
    kinematics = Kinematics(scenario.robot)
    kinematics.update(scenario.q0)
    solve = make_solve(parse_solver(DEFAULT_SOLVER["qp"]), "qp")
    try:
        task = scenario.tracking.linearize(kinematics, *scenario.target(0.0))
        problem = pose_problem(
            kinematics, scenario.v0, scenario.dt, task, scenario.tasks, scenario.constraints
        )
        answer = control_step(_LeastSquares(), problem, solve)
    except (DikbenchError, TrialEnded) as error:
        yield f"its first control step cannot be answered: {error}"
        return
    if answer.status is not Status.OK:
        yield f"its first control step cannot be answered: {answer.status.sentence}"
