"""Strict task priority by null-space projection."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np

from dikbench.array import Array
from dikbench.errors import DikbenchError
from dikbench.linear_algebra import inverse_and_row_space
from dikbench.problem import DikProblem, Solve


@dataclass(frozen=True)
class Nullspace:
    """Strict task priority: each task moves only what the tasks above it leave free.

        v_0 = 0,  N_0 = I
        v_k = v_(k-1) + (J_k N_(k-1))^+ (V_k - J_k v_(k-1))
        N_k = N_(k-1) - (J_k N_(k-1))^+ (J_k N_(k-1))

    over the priority levels k = 1, 2, ...; J_k (m_k, nv) and V_k (m_k,) are level k's, poses in the
    task frame; v in rad/s. Protects the first task exactly and knows no limits; singular wherever
    a task is, or where two tasks become dependent. With damping every inverse A^+ becomes
    A^T (A A^T + lambda^2 I)^-1. Weights play no part.

    Attributes:
        rank_tolerance: singular values of J_k N_(k-1) up to this count as zero (absolute, units of
            J_k: a relative one explodes where nothing is left free).
        damping: lambda, unsquared (units of J_k).
        projector: what becomes of N_k under damping: `exact` keeps it and protects what the tasks
            above have got; `damped` puts the damped inverse into it and leaks into them, the more
            as the task below inverts what leaks.

    Source: [Nakamura1987]; [SicilianoSlotine1991].
    """

    rank_tolerance: float = 1e-6
    damping: float = 0.0
    projector: Literal["exact", "damped"] = "exact"

    def __post_init__(self) -> None:
        """Check the parameters."""
        for name in ("rank_tolerance", "damping"):
            if not 0 <= getattr(self, name) < np.inf:
                raise DikbenchError(f"nullspace: {name} must be finite and at least 0")

    def velocity(self, problem: DikProblem, solve: Solve) -> Array:
        """See `Formulation`."""
        n = problem.robot.nv
        v = np.zeros(n)
        N = np.eye(n)
        for level in problem.levels:
            free = level.J @ N
            inverse, rows = inverse_and_row_space(free, self.rank_tolerance, self.damping)
            v = v + inverse @ (level.V - level.J @ v)
            N = N - (rows.T @ rows if self.projector == "exact" else inverse @ free)
        return v
