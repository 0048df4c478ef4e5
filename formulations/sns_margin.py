"""Optimal saturation in the null space with a scale margin."""

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
class SaturationWithScaleMargin(Parameters):
    """Optimal saturation in the null space that keeps a margin to the largest scale it found.

        v(c) = the answer of `sns-optimal` to the task c V;   s: the largest scale at which the
        joints that v(1) holds are enough (above 1 too);   v = v(min(1, margin s))

    level by level, each in what those above leave free. Near the largest scale the joints that are
    held change from one state to the next, and velocities with them; below it more of them are
    free, and v is the least velocity at its scale. The price is speed: a task is done in full only
    where s >= 1/margin, and is slowed down by the margin also where it could be done in full.

    J (m, nv) and V (m,) are each priority level's, poses in the task frame; v in rad/s. No
    direction error and inside every limit. `Infeasible` where no s fits. Ignores weights.

    Attributes:
        scale_margin: share of the largest scale that is used.
        braking: how the box approaches a position limit (see `dikbench.problem.velocity_box`).
        rank_tolerance: singular values of J W up to this count as zero (absolute, units of J).

    Source: [Flacco2015], whose authors' program sns_ik has this as its FOSNS, and as its OSNS with
    scale margin with the limits multiplied by the margin as well.
    """

    scale_margin: Annotated[float, Range(above=0.0, high=1.0)] = 0.9
    braking: Braking = "viable"
    rank_tolerance: Annotated[float, Range(0.0)] = 1e-6

    keeps: ClassVar[frozenset[LimitKind]] = frozenset({"position", "velocity", "acceleration"})
    sees: ClassVar[frozenset[ProblemPart]] = frozenset({"lower-tasks"})

    def velocity(self, problem: DikProblem, solve: Solve) -> Array:
        """See `Formulation`."""
        box, margin = problem.box(self.braking), self.scale_margin
        return saturated_levels(
            problem, box, self.rank_tolerance, optimal=True, scale_margin=margin
        )
