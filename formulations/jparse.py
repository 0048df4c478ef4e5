"""J-PARSE: the desired motion projected on the directions of the arm."""

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
    by_singular_values,
    divided,
)


@dataclass(frozen=True)
class JParse(Parameters):
    """J-PARSE: the pseudo-inverse with its nearly lost directions scaled down.

        v = sum_i g_i v_i (u_i . V),   g_i = 1/sigma_i                  if sigma_i > gamma sigma_1
                                             sigma_i/(gamma sigma_1)^2  else

    J = sum_i sigma_i u_i v_i^T (m, nv) and V (m,) are the primary task's, in the task frame; v in
    rad/s. Continuous, bounded by ||V|| / (gamma sigma_1) and the pseudo-inverse away from
    singularities; into a singularity it slows down, and out of one it starts slowly. gamma sigma_1
    may be large: many ordinary postures of the arms here count as nearly singular. Ignores limits
    and weights.

    Attributes:
        threshold: gamma, the share of the largest singular value up to which a direction counts as
            nearly lost (the source gives those gains of their own, here 1).

    Source: [Guptasarma2025].
    """

    threshold: Annotated[float, Range(above=0.0, below=1.0), Drawn(0.01, 0.5, log=True)] = 0.1

    batched: ClassVar[bool] = True

    def velocity(self, problem: DikProblem, solve: Solve) -> Array:
        """See `Formulation`."""
        task = problem.primary

        def shares(sigma: Array, parts: Array) -> Array:
            safe = np.maximum(sigma, self.threshold * sigma[..., :1])
            moves = ~(safe <= 0)  # of NaN as well
            return divided(divided(sigma, safe, moves), safe, moves) * parts

        return by_singular_values(task.J, task.V, shares)
