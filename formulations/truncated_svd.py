"""The pseudo-inverse without the nearly lost directions."""

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
    by_singular_values,
    divided,
)


@dataclass(frozen=True)
class TruncatedSvd(Parameters):
    """Truncated singular value decomposition: give up the directions that are nearly lost.

        v = sum_i v_i (u_i . V) / sigma_i   over sigma_i > c sigma_1

    J = sum_i sigma_i u_i v_i^T (m, nv) and V (m,) are the primary task's, in the task frame; v in
    rad/s. Bounded by ||V|| / (c sigma_1) and the pseudo-inverse where nothing is given up; jumps,
    and chatters in closed loop, where a singular value crosses the threshold. Ignores limits
    and weights.

    Attributes:
        relative_tolerance: c, the share of the largest singular value up to which a direction is
            dropped; 0.01 in the source's published code.

    Source: [Buss2004].
    """

    relative_tolerance: Annotated[float, Range(0.0, below=1.0), Drawn(1e-3, 0.2, log=True)] = 0.01

    batched: ClassVar[bool] = True

    def velocity(self, problem: DikProblem, solve: Solve) -> Array:
        """See `Formulation`."""
        task = problem.primary

        def shares(sigma: Array, parts: Array) -> Array:
            lost = sigma <= self.relative_tolerance * sigma[..., :1]
            return divided(parts, sigma, ~lost)

        return by_singular_values(task.J, task.V, shares)
