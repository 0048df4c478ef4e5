"""What a robot must not do beyond the limits of its joints: one constraint per file."""

from dikbench.constraints.constraint import Constraint, linearize_all
from dikbench.constraints.torque import TorqueConstraint

__all__ = ["Constraint", "TorqueConstraint", "linearize_all"]
