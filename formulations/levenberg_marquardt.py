"""Damping that grows with the task's error."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated, ClassVar

import numpy as np

from dikbench.problem import (
    Array,
    DikProblem,
    Drawn,
    Parameters,
    ProblemPart,
    Range,
    Solve,
    damped_least_squares,
    dot,
)


@dataclass(frozen=True)
class LevenbergMarquardt(Parameters):
    """Levenberg-Marquardt: damped least squares, the more damped the larger the error.

        v = (J^T W J + lambda^2 I)^-1 J^T W V,   lambda^2 = k E + damping^2,   E = 1/2 e^T W e

    J (m, nv), V (m,), the error e (m,) and the weights W are the primary task's, in the task
    frame; v in rad/s. Three rules in two numbers: Chan & Lawrence k > 0, damping 0; Sugihara k = 1,
    damping > 0 (his bias is damping^2, the same for all joints); Wampler's fixed damping k = 0,
    with W = I the formulation `dls`. Strongly damped far from a target, exact at the target; while
    E is small only the fixed part damps at a singularity. The sources use displacements, V = e.
    Ignores limits.

    Attributes:
        error_factor: k; 0.1-1 in the literature.
        damping: the fixed part, unsquared; a bias of 1e-4 to 1e-3 in the literature.

    Source: [ChanLawrence1988], [Sugihara2011]; [Wampler1986] for the fixed damping.
    """

    error_factor: Annotated[float, Range(0.0), Drawn(1e-2, 100.0, log=True)] = 1.0
    damping: Annotated[float, Range(0.0), Drawn(1e-4, 0.1, log=True)] = 0.01

    batched: ClassVar[bool] = True
    sees: ClassVar[frozenset[ProblemPart]] = frozenset({"weights"})

    def velocity(self, problem: DikProblem, solve: Solve) -> Array:
        """See `Formulation`."""
        task = problem.primary
        root = np.sqrt(np.broadcast_to(task.weight, task.V.shape))
        error = root * task.error
        squared = 0.5 * self.error_factor * dot(error, error) + self.damping**2
        return damped_least_squares(root[..., None] * task.J, root * task.V, squared)
