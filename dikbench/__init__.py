"""dikbench: a benchmark suite for differential inverse kinematics.

A study crosses formulations with scenarios, solvers and seeds into trials; a trial is simulated
into a trace; metrics read the trace; results keep one row per trial; the report reads the results.

Authors import from `dikbench.problem` for a formulation, `dikbench.scenario` for a family or a
plant, `dikbench.metrics` for a metric, `dikbench.solvers` for a solver, `dikbench.robots` for a
robot and `dikbench.testing` for the contracts.
"""

from __future__ import annotations

import importlib
from typing import TYPE_CHECKING, Any, Final

if TYPE_CHECKING:
    from dikbench.cli.running import run_study
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
    from dikbench.robots.collision.obstacles import BoxObstacle, CapsuleObstacle, SphereObstacle
    from dikbench.robots.loading import load_robot
    from dikbench.robots.robot import Robot
    from dikbench.scenario.scenario import Scenario
    from dikbench.simulation.one_step import DikAnswer, solve_dik
    from dikbench.simulation.status import Status

    __version__: str

_HOME: Final = {
    "errors": ("DikbenchError", "Infeasible", "SolverFailed"),
    "problem.constraints": ("CollisionConstraint", "Constraint", "TorqueConstraint"),
    "problem.problem": ("DikProblem", "Formulation", "Solve"),
    "problem.tasks": (
        "CentreOfMassTask",
        "DampingTask",
        "LinearizedTask",
        "OrientationTask",
        "PoseTask",
        "PositionTask",
        "PostureTask",
        "Task",
    ),
    "programs.quadratic_program": ("QuadraticProgram",),
    "results.reading": ("Results", "load_results"),
    "robots.loading": ("load_robot",),
    "robots.collision.obstacles": ("BoxObstacle", "CapsuleObstacle", "SphereObstacle"),
    "robots.robot": ("Robot",),
    "cli.running": ("run_study",),
    "scenario.scenario": ("Scenario",),
    "simulation.one_step": ("DikAnswer", "solve_dik"),
    "simulation.status": ("Status",),
}

_DOORS: Final = ("metrics", "problem", "robots", "scenario", "solvers", "testing")

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
    "__version__",
    "load_results",
    "load_robot",
    "run_study",
    "solve_dik",
]


def __getattr__(name: str) -> Any:
    """Import a public name on first use, so that `dikbench --help` does not wait for Pinocchio."""
    if name == "__version__":
        from importlib.metadata import version

        return version("dikbench")
    if name in _DOORS:
        return importlib.import_module(f"dikbench.{name}")
    for module, names in _HOME.items():
        if name in names:
            return getattr(importlib.import_module(f"dikbench.{module}"), name)
    raise AttributeError(f"module 'dikbench' has no attribute {name!r}")


def __dir__() -> list[str]:
    """List the public names and the doors, imported or not."""
    return sorted([*__all__, *_DOORS])
