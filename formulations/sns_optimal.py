"""Optimal saturation in the null space."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated, ClassVar

from dikbench.problem import (
    Array,
    Braking,
    DikProblem,
    LimitKind,
    Parameters,
    ProblemPart,
    Range,
    Solve,
)
from formulations.saturation import saturated_levels


@dataclass(frozen=True)
class OptimalSaturationInNullSpace(Parameters):
    """Optimal saturation in the null space: `sns` that releases joints held without need.

    As `sns`, but whenever a scale s fits, the joints held at a bound without which the motion
    would be smaller are released, by the sign of their multiplier in

        min_v 1/2 ||v||^2   s.t.   J v = s V,   lo <= v <= hi,
        mu = T^T v,   T_j = dv/d(bound_j),   mu_j <= 0 at hi,   mu_j >= 0 at lo

    (below the first level v - v_(k-1) takes the place of v in the norm and in mu). Where s = 1
    fits, the velocity is the least one that does the task. The multipliers are those of the norm,
    not of s: where the task has to be scaled it comes nearer to the largest s than `sns` in some
    states and less near in others. J (m, nv) and V (m,) are each priority level's, poses in the
    task frame; v in rad/s. Strict priority, bounds active or not; `Infeasible` where no s fits.
    Ignores weights.

    Attributes:
        braking: how the box approaches a position limit (see `dikbench.problem.velocity_box`).
        rank_tolerance: singular values of J W up to this count as zero (absolute, units of J).

    Source: [Flacco2015].
    """

    braking: Braking = "viable"
    rank_tolerance: Annotated[float, Range(0.0)] = 1e-6

    keeps: ClassVar[frozenset[LimitKind]] = frozenset({"position", "velocity", "acceleration"})
    sees: ClassVar[frozenset[ProblemPart]] = frozenset({"lower-tasks"})

    def velocity(self, problem: DikProblem, solve: Solve) -> Array:
        """See `Formulation`."""
        box = problem.box(self.braking)
        return saturated_levels(problem, box, self.rank_tolerance, optimal=True)
