"""Optimal saturation in the null space."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from dikbench.array import Array
from dikbench.box import Braking
from dikbench.errors import DikbenchError
from dikbench.problem import DikProblem, LimitKind, Solve
from formulations.saturation import saturated_levels


@dataclass(frozen=True)
class OptimalSaturationInNullSpace:
    """Optimal saturation in the null space: `sns` that lets go of joints held in vain.

    As `sns`, but where one more joint cannot be held, that joint changes places with a held one if
    the scale grows by it, ds/d(bound_j) > 0 on the way off the bound: a pivot of the simplex method
    on max s. And where s = 1 fits, joints come off their bounds, by the sign of their multiplier,
    until the velocity is the least one that does the task:

        min_v 1/2 ||v||^2   s.t.   J v = V,   lo <= v <= hi,
        mu = T^T v,   T_j = dv/d(bound_j),   mu_j <= 0 at hi,   mu_j >= 0 at lo

    (from the second start of `sns`: the least change of velocity). Reaches the s of the linear
    program but in one of hundreds of states, without a solver. J (m, nv) and V (m,) are each
    priority level's, poses in the task frame; v in rad/s. Strict priority, bounds active or not;
    `Infeasible` where no s fits. Weights play no part.

    Attributes:
        braking: how the box approaches a position limit (see `dikbench.box`).
        rank_tolerance: singular values of J W up to this count as zero (absolute, units of J).

    Source: [Flacco2015], whose multipliers are those of the norm alone, which let go of joints that
    the scale needs.
    """

    braking: Braking = "viable"
    rank_tolerance: float = 1e-6

    keeps: ClassVar[frozenset[LimitKind]] = frozenset({"position", "velocity", "acceleration"})

    def __post_init__(self) -> None:
        """Check the parameters."""
        if not 0 <= self.rank_tolerance < np.inf:
            raise DikbenchError("sns-optimal: rank_tolerance must be finite and at least 0")

    def velocity(self, problem: DikProblem, solve: Solve) -> Array:
        """See `Formulation`."""
        box = problem.box(self.braking)
        return saturated_levels(problem, box, self.rank_tolerance, optimal=True)
