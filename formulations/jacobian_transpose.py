"""The Jacobian transpose."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated, ClassVar

import numpy as np

from dikbench.problem import (
    Array,
    DikProblem,
    Parameters,
    Range,
    Solve,
    divided,
    dot,
    times,
    transposed,
)


@dataclass(frozen=True)
class JacobianTranspose(Parameters):
    """Jacobian transpose: steepest descent on the task's error, with the best step.

        v = a J^T V,   a = <V, J J^T V> / ||J J^T V||^2

    J (m, nv) and V (m,) are the primary task's, in the task frame; v in rad/s. a minimises
    ||a J J^T V - V||. Needs no inverse and is bounded at a singularity, but has direction errors
    wherever J J^T V is not along V: directions with small singular values hardly move. Ignores
    limits and weights.

    Attributes:
        rank_tolerance: V is taken as lost, and v = 0, where ||J^T V|| is up to this share of ||V||
            (absolute, units of J); hence ||v|| <= ||V|| / rank_tolerance.

    Source: [WolovichElliott1984], [Balestrino1984]; the step is that of [Buss2004].
    """

    rank_tolerance: Annotated[float, Range(above=0.0)] = 1e-6

    batched: ClassVar[bool] = True

    def velocity(self, problem: DikProblem, solve: Solve) -> Array:
        """See `Formulation`."""
        task = problem.primary
        J, V = task.J, task.V
        largest = np.abs(V).max(axis=-1)
        direction = V / np.where(largest == 0, 1.0, largest)[..., None]  # its squares do not vanish
        g = times(transposed(J), direction)
        steepness = dot(g, g)
        lost = steepness <= self.rank_tolerance**2 * dot(direction, direction)
        motion = times(J, g)
        length = divided(largest * steepness, dot(motion, motion), ~lost)
        return g * length[..., None]
