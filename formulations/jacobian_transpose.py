"""The Jacobian transpose."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated

import numpy as np

from dikbench.problem import Array, DikProblem, Parameters, Range, Solve


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

    def velocity(self, problem: DikProblem, solve: Solve) -> Array:
        """See `Formulation`."""
        task = problem.primary
        J, V = task.J, task.V
        largest = float(np.abs(V).max())
        if largest == 0:
            return np.zeros(J.shape[1])
        direction = V / largest  # its squares neither underflow nor overflow
        g = direction.dot(J)
        steepness = float(g.dot(g))
        if steepness <= self.rank_tolerance**2 * float(direction.dot(direction)):
            return np.zeros(J.shape[1])
        motion = J.dot(g)
        v: Array = g * (largest * steepness / float(motion.dot(motion)))
        return v
