"""Saturation in the null space."""

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
class SaturationInNullSpace(Parameters):
    """Saturation in the null space: hold joints at their bounds, let the others compensate.

        v = v_N + (J W)^+ (s V - J v_N),   lo <= v <= hi   (the velocity box),   0 <= s <= 1

    For one task W = I and v_N = 0 to begin with. While a joint of v at s = 1 is outside the box:
    the largest s that fits is noted; the joint that allows the least is held at the bound that it
    breaks (W_jj = 0, v_N,j = that bound); where J W loses rank the best s so far is taken. Below
    it each priority level k does the same in what the levels above leave free: N_(k-1), the
    projector onto their null space, takes the place of I and v_(k-1) that of 0, and joints that
    were held are free to come off their bounds. A level for which no s fits is left out.

    J (m, nv) and V (m,) are each level's, poses in the task frame; v in rad/s. Strict priority
    with and without active bounds; no direction error and inside every limit; s is below the
    largest possible one in some states (one in twenty of a Panda asked for too much). At a
    singularity it behaves as the pseudo-inverse does. Where the box excludes rest (outside a limit,
    or in motion under acceleration limits) this may find no s for the first task: then it starts
    again with v_N = v_prev, and joints are held of the least change of velocity. `Infeasible` where
    that finds none either. Ignores weights.

    Attributes:
        braking: how the box approaches a position limit (see `dikbench.problem.velocity_box`).
        rank_tolerance: singular values of J W up to this count as zero (absolute, units of J).

    Source: [Flacco2012]; [Flacco2015], whose saturation of accelerations is the second start. Only
    joints outside the box are saturated, which the papers do not say and boxes that exclude rest
    need.
    """

    braking: Braking = "viable"
    rank_tolerance: Annotated[float, Range(0.0)] = 1e-6

    keeps: ClassVar[frozenset[LimitKind]] = frozenset({"position", "velocity", "acceleration"})
    sees: ClassVar[frozenset[ProblemPart]] = frozenset({"lower-tasks"})

    def velocity(self, problem: DikProblem, solve: Solve) -> Array:
        """See `Formulation`."""
        box = problem.box(self.braking)
        return saturated_levels(problem, box, self.rank_tolerance, optimal=False)
