"""Selectively damped least squares."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import accumulate
from typing import Annotated, Final, Literal

import numpy as np

from dikbench.problem import Array, DikProblem, Drawn, Parameters, Range, Solve, rank, thin_svd

LARGEST_SKIPPED_SINGULAR_VALUE: Final = 1e-10
"""Directions with singular values up to this are skipped, as in the authors' code."""


@dataclass(frozen=True)
class SelectiveDamping(Parameters):
    """Selectively damped least squares: limit each singular direction by its own reach.

        phi_i   = v_i (u_i . V) / sigma_i
        N_i     = sum_k ||u_i^(k)||,   M_i = (1/sigma_i) sum_j |v_ji| sum_k ||J_j^(k)||
        gamma_i = min(1, N_i/M_i) gamma_max
        hard:  v = clamp(sum_i clamp(phi_i, gamma_i), gamma_max),
               clamp(x, g) = x min(1, g / max|x|)
        soft:  phi_i gamma_i/(gamma_i + max|phi_i|); the sum s where max|s| > gamma_max likewise:
               v = s gamma_max/(gamma_max + max|s|)

    J = sum_i sigma_i u_i v_i^T (m, nv) and V (m,) are the primary task's, in the task frame; v in
    rad/s. x^(k) is the part of the k-th end effector, here of the k-th task of first priority (in
    the source each has three rows; here a pose is one). No joint is faster than gamma_max; a nearly
    lost direction moves slowly, unless its joints have no other use, and other directions are not
    damped. The soft variant has direction errors everywhere, and jumps to half the velocity where
    the sum reaches gamma_max. Ignores limits and weights.

    Attributes:
        max_rate: gamma_max [rad/s]. The source limits displacements to pi/4 per iteration; the
            default is about a joint's speed limit.
        clamp: hard, as in the paper, or soft, as in the authors' published code.

    Source: [BussKim2005].
    """

    max_rate: Annotated[float, Range(above=0.0, unit="rad/s"), Drawn(0.3, 30.0, log=True)] = 2.0
    clamp: Literal["hard", "soft"] = "hard"

    def velocity(self, problem: DikProblem, solve: Solve) -> Array:
        """See `Formulation`."""
        task = problem.primary
        U, sigma, Vt = thin_svd(task.J)
        k = rank(sigma, LARGEST_SKIPPED_SINGULAR_VALUE)
        U, sigma, Vt = U[:, :k], sigma[:k], Vt[:k]
        priority = problem.tasks[0].priority
        rows = accumulate(len(other.V) for other in problem.tasks if other.priority == priority)
        starts = [0, *rows][:-1]
        N, reach = _lengths(U, starts), _lengths(task.J, starts)
        size = np.abs(Vt)
        # N_i <= M_i by the triangle inequality: min(1, N_i/M_i) needs no minimum.
        gamma = N * sigma / size.dot(reach) * self.max_rate
        response = task.V.dot(U) / sigma
        largest = np.abs(response) * size.max(axis=1)
        if self.clamp == "soft":
            v: Array = (response * gamma / (gamma + largest)).dot(Vt)
            fastest = float(np.abs(v).max())
            return v * (self.max_rate / (self.max_rate + fastest) if fastest > self.max_rate else 1)
        v = (response * gamma / np.maximum(gamma, largest)).dot(Vt)
        return v * (self.max_rate / max(self.max_rate, float(np.abs(v).max())))


def _lengths(columns: Array, starts: list[int]) -> Array:
    """Sum the norms of each column's blocks, which start at these rows, (m, n) -> (n,)."""
    lengths: Array = np.sqrt(np.add.reduceat(columns**2, starts)).sum(axis=0)
    return lengths
