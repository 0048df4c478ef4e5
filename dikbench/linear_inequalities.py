"""Linear inequalities: the shortest vector that meets them."""

from __future__ import annotations

import numpy as np
from scipy.optimize import nnls

from dikbench.arrays import Array

NO_ROW = 1e-12
"""Length up to which the row of an inequality bounds nothing."""

INCONSISTENT = 1e-8
"""Inequalities of rows of about unit length that can only be met to more than this contradict each
other."""


def shortest(G: Array, h: Array) -> Array | None:
    """Find the shortest x (n,) with G x <= h, for G (p, n), h (p,); None where there is none.

    With the rows scaled to unit length, u >= 0 the least-squares solution of
    [-G^T; -h^T] u = (0, ..., 0, 1) and r what is left of it, x_j = -r_j / r_(n+1); r = 0 where no x
    does it.

    Source: Lawson & Hanson (1974), Solving Least Squares Problems, chapter 23.
    """
    n, size = G.shape[1], np.linalg.norm(G, axis=1)
    rows = size > NO_ROW
    if not rows.any():  # which scipy's solver does not survive
        return np.zeros(n) if h.min(initial=0.0) >= -INCONSISTENT else None
    E, f = -np.vstack([G[rows].T, h[rows]]) / size[rows], np.zeros(n + 1)
    f[n] = 1.0
    try:
        u, _ = nnls(E, f)
    except RuntimeError:  # it counts its iterations
        return None
    left = E @ u - f
    if -left[n] < INCONSISTENT:
        return None
    x: Array = -left[:n] / left[n]
    return x if (G @ x - h).max(initial=0.0) <= INCONSISTENT else None
