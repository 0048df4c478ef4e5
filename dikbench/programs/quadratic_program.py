"""A quadratic (or linear) program in matrices."""

from __future__ import annotations

from typing import Literal

import msgspec

from dikbench.arrays import Array

ProgramKind = Literal["qp", "lp", "cvxpy"]
"""What a formulation has solved: a strictly convex quadratic program, one that may be linear, or
one written in cvxpy's modelling language."""


class QuadraticProgram(msgspec.Struct, eq=False):
    """A quadratic program in x, or a linear one where P = 0.

        min 1/2 x^T P x + q^T x   s.t.   G x <= h,   A x = b,   lb <= x <= ub

    Its parts have the names that the library qpsolvers gives them.

    Attributes:
        P: (n, n), symmetric positive semidefinite.
        q: (n,).
        G, h: (p, n) and (p,), or None.
        A, b: (m, n) and (m,), or None.
        lb, ub: (n,) each, possibly infinite, or None.
    """

    P: Array
    q: Array
    G: Array | None = None
    h: Array | None = None
    A: Array | None = None
    b: Array | None = None
    lb: Array | None = None
    ub: Array | None = None
