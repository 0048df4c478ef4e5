"""dikbench: a benchmark suite for differential inverse kinematics.

A study crosses formulations with scenarios, solvers and seeds into trials; a trial is simulated
into a trace; metrics read the trace; the store keeps one row per trial; the report reads the store.
"""

from __future__ import annotations

import importlib
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from dikbench.constraints import CollisionConstraint, Constraint, TorqueConstraint
    from dikbench.errors import DikbenchError, Infeasible, SolverFailed
    from dikbench.obstacles import BoxObstacle, CapsuleObstacle, SphereObstacle
    from dikbench.one_step import DikAnswer, solve_dik
    from dikbench.problem import DikProblem, Formulation, Solve
    from dikbench.quadratic_program import QuadraticProgram
    from dikbench.robot import Robot
    from dikbench.robot_catalogue import load_robot
    from dikbench.scenario import Scenario
    from dikbench.status import Status
    from dikbench.tasks import (
        CentreOfMassTask,
        DampingTask,
        LinearizedTask,
        OrientationTask,
        PoseTask,
        PositionTask,
        PostureTask,
        Task,
    )
    from dikbench.tidy import Results, load_results

_HOME = {
    "BoxObstacle": "obstacles",
    "CapsuleObstacle": "obstacles",
    "CentreOfMassTask": "tasks",
    "CollisionConstraint": "constraints",
    "Constraint": "constraints",
    "DampingTask": "tasks",
    "DikAnswer": "one_step",
    "DikProblem": "problem",
    "DikbenchError": "errors",
    "Formulation": "problem",
    "Infeasible": "errors",
    "LinearizedTask": "tasks",
    "OrientationTask": "tasks",
    "PoseTask": "tasks",
    "PositionTask": "tasks",
    "PostureTask": "tasks",
    "QuadraticProgram": "quadratic_program",
    "Results": "tidy",
    "Robot": "robot",
    "Scenario": "scenario",
    "Solve": "problem",
    "SolverFailed": "errors",
    "SphereObstacle": "obstacles",
    "Status": "status",
    "Task": "tasks",
    "TorqueConstraint": "constraints",
    "load_results": "tidy",
    "load_robot": "robot_catalogue",
    "solve_dik": "one_step",
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
