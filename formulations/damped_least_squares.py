"""Damped least squares."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated, ClassVar

from dikbench.problem import (
    Array,
    DikProblem,
    Drawn,
    Parameters,
    Range,
    Solve,
    damped_least_squares,
)


@dataclass(frozen=True)
class DampedLeastSquares(Parameters):
    """Damped least squares: trade tracking for speed near singularities.

        min ||J v - V||^2 + lambda^2 ||v||^2,   v = J^T (J J^T + lambda^2 I)^-1 V

    J (m, nv) and V (m,) are the primary task's, in the task frame; v in rad/s. Bounded by
    ||V|| / (2 lambda) and never exact. Ignores limits and weights.

    Attributes:
        damping: lambda, unsquared (units of J); 0.01-0.05 in the recent literature.

    Source: [Wampler1986], [NakamuraHanafusa1986].
    """

    damping: Annotated[float, Range(0.0), Drawn(1e-3, 0.3, log=True)] = 0.05

    batched: ClassVar[bool] = True

    def velocity(self, problem: DikProblem, solve: Solve) -> Array:
        """See `Formulation`."""
        task = problem.primary
        return damped_least_squares(task.J, task.V, self.damping**2)
