"""The pseudo-inverse with filtered singular values."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated, ClassVar

from dikbench.errors import DikbenchError
from dikbench.problem import (
    Array,
    DikProblem,
    Drawn,
    Parameters,
    Range,
    Solve,
    by_singular_values,
)


@dataclass(frozen=True)
class SingularValueFiltering(Parameters):
    """Singular value filtering: invert singular values that are raised to a smallest value.

        v = sum_i v_i (u_i . V) / h(sigma_i)
        h(s) = (s^3 + nu s^2 + 2 s + 2 s_0) / (s^2 + nu s + 2) = s + 2 s_0 / (s^2 + nu s + 2)

    J = sum_i sigma_i u_i v_i^T (m, nv) and V (m,) are the primary task's, in the task frame; v in
    rad/s. h(0) = s_0 and h rises, hence ||v|| <= ||V|| / s_0, also where rank is lost. Smooth and
    nearly exact away from singularities. At a singularity it does not slow down: the lost direction
    has the gain 1/s_0, in a joint direction v_m that is then arbitrary. Ignores limits and weights.

    Attributes:
        smallest: s_0, the value that replaces a lost singular value (units of J); 0.005-0.01.
        shape: nu, which determines how closely h follows s; between s_0 and 2/s_0, where h rises.

    Source: [ColomeTorras2015].
    """

    smallest: Annotated[float, Range(above=0.0), Drawn(2e-3, 0.1, log=True)] = 0.01
    shape: Annotated[float, Range(above=0.0), Drawn(1.0, 20.0, log=True)] = 10.0

    def check(self) -> None:
        """Check that h rises."""
        if not self.smallest < self.shape < 2 / self.smallest:
            raise DikbenchError(
                f"shape={self.shape} must be between smallest={self.smallest} and 2 / smallest"
            )

    batched: ClassVar[bool] = True

    def velocity(self, problem: DikProblem, solve: Solve) -> Array:
        """See `Formulation`."""
        task = problem.primary

        def shares(sigma: Array, parts: Array) -> Array:
            return parts / (sigma + 2 * self.smallest / ((sigma + self.shape) * sigma + 2))

        return by_singular_values(task.J, task.V, shares)
