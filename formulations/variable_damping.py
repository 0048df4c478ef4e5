"""Damped least squares whose damping grows as the smallest singular value falls."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated, ClassVar, Literal

import numpy as np

from dikbench.problem import (
    Array,
    DikProblem,
    Drawn,
    Parameters,
    Range,
    Solve,
    by_singular_values,
    divided,
)


@dataclass(frozen=True)
class VariableDamping(Parameters):
    """Variable damping: damp the lost direction only, and only near a singularity.

        numerical:  v = J^T (J J^T + beta^2 I + lambda^2 u_m u_m^T)^-1 V
        isotropic:  v = J^T (J J^T + beta^2 I + lambda^2 I)^-1 V
        lambda^2 = (1 - (sigma_m/eps)^2) lambda_max^2  if sigma_m < eps,  else 0

    with sigma_m the smallest singular value of J and u_m its left singular vector. J (m, nv) and
    V (m,) are the primary task's, in the task frame; v in rad/s. Exact away from singularities
    and, with numerical filtering, in the directions that remain; where two directions are lost at
    once only beta damps the second. Ignores limits and weights.

    Attributes:
        damping: lambda_max, unsquared (units of J); 0.02-0.1 in the literature.
        threshold: eps, the singular value below which there is damping; 0.02-0.1 in the literature.
        isotropic_damping: beta, unsquared; much smaller than lambda_max where it is used.
        filtering: whether lambda damps the last direction alone or all of them.
        rank_tolerance: singular values that are no larger than this when damped are not inverted
            (absolute, units of J).

    Source: [MaciejewskiKlein1988] (numerical filtering), [Egeland1991] (lambda),
    [Chiaverini1994] (both, and beta).
    """

    damping: Annotated[float, Range(0.0), Drawn(1e-3, 0.3, log=True)] = 0.05
    threshold: Annotated[float, Range(above=0.0), Drawn(0.01, 0.3, log=True)] = 0.05
    isotropic_damping: Annotated[float, Range(0.0), Drawn(1e-4, 0.05, log=True)] = 0.0
    filtering: Literal["numerical", "isotropic"] = "numerical"
    rank_tolerance: Annotated[float, Range(0.0)] = 1e-6

    batched: ClassVar[bool] = True

    def velocity(self, problem: DikProblem, solve: Solve) -> Array:
        """See `Formulation`."""
        task = problem.primary

        def shares(sigma: Array, parts: Array) -> Array:
            squares = sigma**2 + self.isotropic_damping**2
            nearness = np.maximum(0.0, 1.0 - (sigma[..., -1:] / self.threshold) ** 2)
            damped = slice(-1, None) if self.filtering == "numerical" else slice(None)
            squares[..., damped] += nearness * self.damping**2
            return divided(sigma, squares, ~(squares <= self.rank_tolerance**2)) * parts

        return by_singular_values(task.J, task.V, shares)
