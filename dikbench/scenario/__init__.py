"""A closed-loop case: everything that the author of a family imports.

These are robots, references, tasks and constraints of which a scenario is built, the exact joint
motion on which its certificate is measured, and the perturbation by a seed.
"""

from __future__ import annotations

from dikbench.arrays import Array, Mask
from dikbench.linear_algebra import damped_least_squares, null_space
from dikbench.parameters import Drawn, Parameters, Range
from dikbench.problem.constraints import CollisionConstraint, Constraint, TorqueConstraint
from dikbench.problem.constraints.torque import effort_limits
from dikbench.problem.tasks import (
    CentreOfMassTask,
    OrientationTask,
    PoseTask,
    PositionTask,
    PostureTask,
    Task,
    TrackingTask,
    TrackingTogether,
)
from dikbench.robots.collision.obstacles import (
    BoxObstacle,
    CapsuleObstacle,
    Obstacle,
    SphereObstacle,
)
from dikbench.robots.kinematics import Kinematics, smallest_singular_value
from dikbench.robots.loading import load_robot
from dikbench.robots.payload import with_payload
from dikbench.robots.robot import Robot
from dikbench.scenario.building import (
    POSTURE_WEIGHT,
    JointMotion,
    at_constant_rate,
    check_can_lift,
    check_velocity_limits,
    collision_claims,
    duration_at,
    from_rest_to_rest,
    influence_distance,
    least_norm_share,
    limits_in_force,
    motion_of_a_step,
    placement_of,
    samples,
    secondary_tasks,
    start_velocity,
    step_claims,
    there_and_back,
    usual_claims,
)
from dikbench.scenario.certificate import Certificate, CertificateFailed, Claim
from dikbench.scenario.family import Case, Family, Gain, Time
from dikbench.scenario.named_robots import NamedRobotFamily
from dikbench.scenario.obstacle_file import read_obstacles
from dikbench.scenario.oracle import (
    OracleMotion,
    joint_oracle,
    measure_motion,
    oracle_motion,
    position_margin,
    solve_placement,
)
from dikbench.scenario.plant import Plant, Step
from dikbench.scenario.reference.curves import circle, lemniscate, plane_of
from dikbench.scenario.reference.pose_file import PoseFile, read_poses
from dikbench.scenario.reference.reference import (
    Reference,
    along_screw,
    joint_path,
    screw_path,
    target_at_rest,
)
from dikbench.scenario.reference.spline import spline_through
from dikbench.scenario.reference.waypoints import held, through
from dikbench.scenario.scenario import Scenario
from dikbench.scenario.singularity import (
    Kind,
    Singularity,
    analyse,
    body_twist,
    make_singular,
    singular_postures,
)
from dikbench.scenario.situation import NEAR_SINGULARITY, SINGULAR_NEED, Situation
from dikbench.scenario.variation import Perturbation, Variation

__all__ = [
    "NEAR_SINGULARITY",
    "POSTURE_WEIGHT",
    "SINGULAR_NEED",
    "Array",
    "BoxObstacle",
    "CapsuleObstacle",
    "Case",
    "CentreOfMassTask",
    "Certificate",
    "CertificateFailed",
    "Claim",
    "CollisionConstraint",
    "Constraint",
    "Drawn",
    "Family",
    "Gain",
    "JointMotion",
    "Kind",
    "Kinematics",
    "Mask",
    "NamedRobotFamily",
    "Obstacle",
    "OracleMotion",
    "OrientationTask",
    "Parameters",
    "Perturbation",
    "Plant",
    "PoseFile",
    "PoseTask",
    "PositionTask",
    "PostureTask",
    "Range",
    "Reference",
    "Robot",
    "Scenario",
    "Singularity",
    "Situation",
    "SphereObstacle",
    "Step",
    "Task",
    "Time",
    "TorqueConstraint",
    "TrackingTask",
    "TrackingTogether",
    "Variation",
    "along_screw",
    "analyse",
    "at_constant_rate",
    "body_twist",
    "check_can_lift",
    "check_velocity_limits",
    "circle",
    "collision_claims",
    "damped_least_squares",
    "duration_at",
    "effort_limits",
    "from_rest_to_rest",
    "held",
    "influence_distance",
    "joint_oracle",
    "joint_path",
    "least_norm_share",
    "lemniscate",
    "limits_in_force",
    "load_robot",
    "make_singular",
    "measure_motion",
    "motion_of_a_step",
    "null_space",
    "oracle_motion",
    "placement_of",
    "plane_of",
    "position_margin",
    "read_obstacles",
    "read_poses",
    "samples",
    "screw_path",
    "secondary_tasks",
    "singular_postures",
    "smallest_singular_value",
    "solve_placement",
    "spline_through",
    "start_velocity",
    "step_claims",
    "target_at_rest",
    "there_and_back",
    "through",
    "usual_claims",
    "with_payload",
]
