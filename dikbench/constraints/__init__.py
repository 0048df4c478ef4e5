"""What a robot must not do beyond the limits of its joints: one constraint per file."""

from dikbench.constraints.collision import CollisionConstraint
from dikbench.constraints.constraint import Constraint, linearize_all
from dikbench.constraints.torque import TorqueConstraint

__all__ = ["CollisionConstraint", "Constraint", "TorqueConstraint", "linearize_all"]
