"""Successive corrections without a projector: a mistake, kept for comparison."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from dikbench.array import Array
from dikbench.errors import DikbenchError
from dikbench.linear_algebra import pseudo_inverse
from dikbench.problem import DikProblem, Solve


@dataclass(frozen=True)
class NullspaceUnprojected:
    """Unprojected correction: does NOT protect the first task, although it is taught as if it did.

        v_1 = J_1^+ V_1,   v_k = v_(k-1) + J_k^+ (V_k - J_k v_(k-1))

    over the priority levels k = 1, 2, ...; J_k (m_k, nv) and V_k (m_k,) are level k's, poses in the
    task frame; v in rad/s. The correction is not projected into the null space of the tasks above:
    it is the *last* task that is done exactly, and with a posture task below it the first is not
    done at all. Equal to `nullspace` where the tasks are orthogonal (J_1 J_2^T = 0). Knows no
    limits. Weights play no part.

    Attributes:
        rank_tolerance: singular values up to this count as zero (absolute, units of J_k).

    Source: lecture notes on pick and place after Tedrake, Robotic Manipulation, whose first form of
    the null-space law it is.
    """

    rank_tolerance: float = 1e-6

    def __post_init__(self) -> None:
        """Check the parameters."""
        if not 0 <= self.rank_tolerance < np.inf:
            raise DikbenchError(
                "nullspace-unprojected: rank_tolerance must be finite and at least 0"
            )

    def velocity(self, problem: DikProblem, solve: Solve) -> Array:
        """See `Formulation`."""
        v = np.zeros(problem.robot.nv)
        for level in problem.levels:
            v = v + pseudo_inverse(level.J, self.rank_tolerance) @ (level.V - level.J @ v)
        return v
