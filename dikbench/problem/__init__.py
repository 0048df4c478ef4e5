"""One control step: everything that the author of a formulation imports.

The problem and its parts (tasks, limits, the velocity box, rows G v <= h), the programs that a
solver is handed, and linear algebra.
"""

from __future__ import annotations

from dikbench.arrays import Array, Mask
from dikbench.linear_algebra import (
    DampedInverse,
    Projector,
    by_singular_values,
    damped_least_squares,
    divided,
    dot,
    inverse_and_row_space,
    least_norm,
    null_space,
    product,
    pseudo_inverse,
    rank,
    scaled_identity,
    solve_positive_definite,
    thin_svd,
    times,
    transposed,
    volume,
)
from dikbench.parameters import Drawn, Parameters, Range
from dikbench.problem.constraints import (
    CollisionConstraint,
    Constraint,
    TorqueConstraint,
    linearize_all,
)
from dikbench.problem.posing import pose_problem
from dikbench.problem.problem import (
    DikProblem,
    Formulation,
    LimitKind,
    ProblemPart,
    Solve,
    program_of,
    promises_of,
)
from dikbench.problem.tasks import (
    CentreOfMassTask,
    DampingTask,
    OrientationTask,
    PoseTask,
    PositionTask,
    PostureTask,
    Task,
    TrackingTask,
    TrackingTogether,
)
from dikbench.problem.tasks.orientation import LinearizedOrientation
from dikbench.problem.tasks.pose import LinearizedPose
from dikbench.problem.tasks.task import LinearizedJointTask, LinearizedTask
from dikbench.problem.velocity_box import Box, Braking
from dikbench.programs.modelled_program import ModelledProgram
from dikbench.programs.quadratic_program import ProgramKind, QuadraticProgram
from dikbench.robots.braking import sqrt_brake, viable_brake
from dikbench.robots.kinematics import Kinematics
from dikbench.robots.limits import Interval, Limits
from dikbench.robots.robot import Robot

__all__ = [
    "Array",
    "Box",
    "Braking",
    "CentreOfMassTask",
    "CollisionConstraint",
    "Constraint",
    "DampedInverse",
    "DampingTask",
    "DikProblem",
    "Drawn",
    "Formulation",
    "Interval",
    "Kinematics",
    "LimitKind",
    "Limits",
    "LinearizedJointTask",
    "LinearizedOrientation",
    "LinearizedPose",
    "LinearizedTask",
    "Mask",
    "ModelledProgram",
    "OrientationTask",
    "Parameters",
    "PoseTask",
    "PositionTask",
    "PostureTask",
    "ProblemPart",
    "ProgramKind",
    "Projector",
    "QuadraticProgram",
    "Range",
    "Robot",
    "Solve",
    "Task",
    "TorqueConstraint",
    "TrackingTask",
    "TrackingTogether",
    "by_singular_values",
    "damped_least_squares",
    "divided",
    "dot",
    "inverse_and_row_space",
    "least_norm",
    "linearize_all",
    "null_space",
    "pose_problem",
    "product",
    "program_of",
    "promises_of",
    "pseudo_inverse",
    "rank",
    "scaled_identity",
    "solve_positive_definite",
    "sqrt_brake",
    "thin_svd",
    "times",
    "transposed",
    "viable_brake",
    "volume",
]
