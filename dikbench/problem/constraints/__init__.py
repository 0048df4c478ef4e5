"""Constraints in addition to the joint limits; one constraint per file."""

from dikbench.problem.constraints.collision import CollisionConstraint
from dikbench.problem.constraints.constraint import Constraint, linearize_all
from dikbench.problem.constraints.torque import TorqueConstraint

__all__ = ["CollisionConstraint", "Constraint", "TorqueConstraint", "linearize_all"]
