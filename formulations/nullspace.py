"""Strict task priority by null-space projection."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from dikbench.array import Array
from dikbench.errors import DikbenchError
from dikbench.linear_algebra import pseudo_inverse
from dikbench.problem import DikProblem, Solve


@dataclass(frozen=True)
class Nullspace:
    """Strict task priority: each task moves only what the tasks above it leave free.

        v_0 = 0,  N_0 = I
        v_k = v_(k-1) + (J_k N_(k-1))^+ (V_k - J_k v_(k-1))
        N_k = N_(k-1) - (J_k N_(k-1))^+ (J_k N_(k-1))

    over the priority levels k = 1, 2, ...; J_k (m_k, nv) and V_k (m_k,) are level k's, poses in the
    task frame; v in rad/s. Protects the first task exactly and knows no limits; singular wherever
    a task is, or where two tasks become dependent. Weights play no part.

    Attributes:
        rank_tolerance: singular values of J_k N_(k-1) up to this count as zero (absolute, units of
            J_k: a relative one explodes where nothing is left free).

    Source: [Nakamura1987] for two tasks, [SicilianoSlotine1991] for any number.
    """

    rank_tolerance: float = 1e-6

    def __post_init__(self) -> None:
        """Check the parameters."""
        if not 0 <= self.rank_tolerance < np.inf:
            raise DikbenchError("nullspace: rank_tolerance must be finite and at least 0")

    def velocity(self, problem: DikProblem, solve: Solve) -> Array:
        """See `Formulation`."""
        n = problem.robot.nv
        v = np.zeros(n)
        N = np.eye(n)
        for level in problem.levels:
            free = level.J @ N
            inverse = pseudo_inverse(free, self.rank_tolerance)
            v = v + inverse @ (level.V - level.J @ v)
            N = N - inverse @ free
        return v
