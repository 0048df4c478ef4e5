"""Whether OSQP may have stopped at an answer, by its own tolerance."""

from __future__ import annotations

from typing import Final, NoReturn

import numpy as np
from scipy.optimize import lsq_linear

from dikbench.problem import Array, DikProblem, Formulation, ModelledProgram, QuadraticProgram

STOPS_EARLY: Final = "Drake's OSQP stops early"

TOLERANCE: Final = 5e-3
"""Relative residuals at which OSQP may stop: 1e-3, of a program that it scales before."""


class _Posed(Exception):
    """Carries the program that a formulation hands to its solver."""

    def __init__(self, program: QuadraticProgram) -> None:
        super().__init__()
        self.program = program


def posed(formulation: Formulation, problem: DikProblem) -> QuadraticProgram:
    """Return the program that a formulation poses, without solving it."""

    def catch(program: QuadraticProgram | ModelledProgram) -> NoReturn:
        assert isinstance(program, QuadraticProgram)
        raise _Posed(program)

    try:
        formulation.velocity(problem, catch)  # type: ignore[arg-type]
    except _Posed as found:
        return found.program
    raise AssertionError("the formulation poses no program")


def may_stop_at(program: QuadraticProgram, x: Array) -> bool:
    """Say whether the residuals of x are within `TOLERANCE`, relative to what they are sums of.

        |A x - b|, |x beyond its bounds|,   min_(y, z) |P x + q + A^T y + z|

    with z of the sign that a bound allows where x is at it, else 0. An answer to another program
    has residuals of the size of its terms.

    Args:
        program: a program with equalities and bounds.
        x: the answer, (n,).
    """
    P, q, A, b = program.P, program.q, program.A, program.b
    lower, upper = program.lb, program.ub
    assert lower is not None
    assert upper is not None
    n, m = len(x), 0 if A is None else len(A)
    primal = max(float((lower - x).max()), float((x - upper).max()))
    if A is not None and b is not None:
        primal = max(primal, float(np.abs(A @ x - b).max()))
    size = float(np.abs(x).max())
    if primal > TOLERANCE * max(size, 1.0):
        return False
    curved = np.zeros(n) if P is None else P @ x
    at_lower, at_upper = x <= lower + TOLERANCE, x >= upper - TOLERANCE
    tiny = np.finfo(float).tiny  # an interval of `lsq_linear` needs a length
    least = np.concatenate([np.full(m, -np.inf), np.where(at_lower, -np.inf, -tiny)])
    most = np.concatenate([np.full(m, np.inf), np.where(at_upper, np.inf, tiny)])
    columns = np.hstack([np.zeros((n, 0)) if A is None else A.T, np.eye(n)])
    found = lsq_linear(columns, -(curved + q), (least, most))
    residual = float(np.abs(columns @ found.x + curved + q).max())
    return residual <= TOLERANCE * max(float(np.abs(curved).max()), float(np.abs(q).max()))
