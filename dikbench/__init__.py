"""dikbench: a benchmark suite for differential inverse kinematics.

A study crosses formulations with scenarios, solvers and seeds into trials; a trial is simulated
into a trace; metrics read the trace; the store keeps one row per trial; the report reads the store.
"""

from __future__ import annotations

import importlib
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from dikbench.errors import DikbenchError, Infeasible, SolverFailed
    from dikbench.problem.constraints import CollisionConstraint, Constraint, TorqueConstraint
    from dikbench.problem.problem import DikProblem, Formulation, Solve
    from dikbench.problem.tasks import (
        CentreOfMassTask,
        DampingTask,
        LinearizedTask,
        OrientationTask,
        PoseTask,
        PositionTask,
        PostureTask,
        Task,
    )
    from dikbench.programs.quadratic_program import QuadraticProgram
    from dikbench.results.reading import Results, load_results
    from dikbench.robots.catalogue import load_robot
    from dikbench.robots.collision.obstacles import BoxObstacle, CapsuleObstacle, SphereObstacle
    from dikbench.robots.robot import Robot
    from dikbench.scenario.scenario import Scenario
    from dikbench.simulation.one_step import DikAnswer, solve_dik
    from dikbench.simulation.status import Status

_HOME = {
    "BoxObstacle": "robots.collision.obstacles",
    "CapsuleObstacle": "robots.collision.obstacles",
    "CentreOfMassTask": "problem.tasks",
    "CollisionConstraint": "problem.constraints",
    "Constraint": "problem.constraints",
    "DampingTask": "problem.tasks",
    "DikAnswer": "simulation.one_step",
    "DikProblem": "problem",
    "DikbenchError": "errors",
    "Formulation": "problem",
    "Infeasible": "errors",
    "LinearizedTask": "problem.tasks",
    "OrientationTask": "problem.tasks",
    "PoseTask": "problem.tasks",
    "PositionTask": "problem.tasks",
    "PostureTask": "problem.tasks",
    "QuadraticProgram": "programs.quadratic_program",
    "Results": "results.reading",
    "Robot": "robots.robot",
    "Scenario": "scenario",
    "Solve": "problem",
    "SolverFailed": "errors",
    "SphereObstacle": "robots.collision.obstacles",
    "Status": "simulation.status",
    "Task": "problem.tasks",
    "TorqueConstraint": "problem.constraints",
    "load_results": "results.reading",
    "load_robot": "robots.catalogue",
    "solve_dik": "simulation.one_step",
}

__all__ = [
    "BoxObstacle",
    "CapsuleObstacle",
    "CentreOfMassTask",
    "CollisionConstraint",
    "Constraint",
    "DampingTask",
    "DikAnswer",
    "DikProblem",
    "DikbenchError",
    "Formulation",
    "Infeasible",
    "LinearizedTask",
    "OrientationTask",
    "PoseTask",
    "PositionTask",
    "PostureTask",
    "QuadraticProgram",
    "Results",
    "Robot",
    "Scenario",
    "Solve",
    "SolverFailed",
    "SphereObstacle",
    "Status",
    "Task",
    "TorqueConstraint",
    "load_results",
    "load_robot",
    "solve_dik",
]


def __getattr__(name: str) -> Any:
    """Import a public name on first use, so that `dikbench --help` does not wait for Pinocchio."""
    if name not in _HOME:
        raise AttributeError(f"module 'dikbench' has no attribute {name!r}")
    return getattr(importlib.import_module(f"dikbench.{_HOME[name]}"), name)
