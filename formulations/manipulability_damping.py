"""Damped least squares whose damping is switched on by the manipulability."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated, ClassVar

import numpy as np

from dikbench.problem import (
    Array,
    DikProblem,
    Drawn,
    Parameters,
    Range,
    Solve,
    damped_least_squares,
    volume,
)


@dataclass(frozen=True)
class ManipulabilityDamping(Parameters):
    """Damped least squares where the manipulability is low, the pseudo-inverse elsewhere.

        v = J^T (J J^T + lambda^2 I)^-1 V,   w = sqrt(det(J J^T))
        lambda^2 = lambda_0^2 (1 - w/w_0)^2  if w < w_0,  else 0

    J (m, nv) and V (m,) are the primary task's, in the task frame; v in rad/s. Exact away from
    singularities and continuous at w_0; but w is the product of all singular values, which says
    little about the smallest one and has to be tuned to each arm (with more rows than joints it is
    always 0). Ignores limits and weights.

    Attributes:
        damping: lambda_0, unsquared (units of J), at the singularity itself.
        threshold: w_0, the manipulability below which there is damping (units of det J); it
            depends on the arm: at their safe starts the arms here have 0.02 (the UR3, which is thus
            nearly always damped) to 0.3.

    Source: [NakamuraHanafusa1986].
    """

    damping: Annotated[float, Range(0.0), Drawn(1e-3, 0.3, log=True)] = 0.05
    threshold: Annotated[float, Range(above=0.0), Drawn(2e-3, 0.1, log=True)] = 0.02

    batched: ClassVar[bool] = True

    def velocity(self, problem: DikProblem, solve: Solve) -> Array:
        """See `Formulation`."""
        task = problem.primary
        damping = self.damping * np.maximum(0.0, 1.0 - volume(task.J) / self.threshold)
        return damped_least_squares(task.J, task.V, damping**2)
