"""The cvxpy interface: programs as parametrised cvxpy problems, compiled once per shape."""

from __future__ import annotations

import re
import warnings
from dataclasses import dataclass
from functools import lru_cache
from typing import Any

import cvxpy
import numpy as np
import scipy.linalg

from dikbench.arrays import Array
from dikbench.programs.answer import Answer
from dikbench.programs.modelled_program import ModelledProgram
from dikbench.programs.quadratic_program import QuadraticProgram
from dikbench.solvers.catalogue.back_ends import Solver

# Answers are rechecked; a warning about the accuracy of each would fill the output.
warnings.filterwarnings("ignore", module=rf"cvxpy\.|{re.escape(__name__)}")


class ModelledSolver:
    """A back end called through cvxpy."""

    __slots__ = ("_options",)

    def __init__(self, solver: Solver) -> None:
        # cvxpy would start from the previous answer, perhaps of another trial of this process.
        options = {"solver": solver.name.upper(), "warm_start": False}
        self._options: dict[str, Any] = {**options, **solver.settings}

    def __call__(self, program: QuadraticProgram | ModelledProgram, site: int = 0) -> Answer:
        """Solve a program; any failure gives an answer that is not claimed."""
        if isinstance(program, ModelledProgram):
            model, unknowns = program.model, program.unknowns
        else:
            model, unknowns = _modelled(program)
        try:
            model.solve(**self._options)
        except (cvxpy.error.SolverError, ValueError, ArithmeticError):
            return Answer(None, claimed=False)
        values = [unknown.value for unknown in unknowns]
        if any(value is None for value in values):
            return Answer(None, claimed=False)
        x = np.concatenate([np.atleast_1d(value).ravel() for value in values])
        core = getattr(model.solver_stats, "solve_time", None) or 0.0
        return Answer(
            x, model.status == cvxpy.OPTIMAL and bool(np.isfinite(x).all()), core_ns=int(1e9 * core)
        )


@dataclass(frozen=True)
class _Shape:
    """What a compiled problem depends on: sizes, and the indices of finite bounds."""

    unknowns: int
    equalities: int
    inequalities: int
    quadratic: bool
    lower: tuple[int, ...]
    upper: tuple[int, ...]


def _modelled(program: QuadraticProgram) -> tuple[Any, tuple[Any, ...]]:
    """Return the compiled problem of this program's shape with this program's values."""
    shape = _Shape(
        len(program.q),
        0 if program.b is None else len(program.b),
        0 if program.h is None else len(program.h),
        bool(np.any(program.P)),
        _finite(program.lb),
        _finite(program.ub),
    )
    model, x, parameters = _compiled(shape)
    values = {
        "root": _root(program.P) if shape.quadratic else None,
        "q": program.q,
        "A": program.A,
        "b": program.b,
        "G": program.G,
        "h": program.h,
        "lb": None if program.lb is None else program.lb[list(shape.lower)],
        "ub": None if program.ub is None else program.ub[list(shape.upper)],
    }
    for name, parameter in parameters.items():
        parameter.value = values[name]
    return model, (x,)


def _finite(bound: Array | None) -> tuple[int, ...]:
    """Return the indices of the finite entries of a bound."""
    return () if bound is None else tuple(int(i) for i in np.flatnonzero(np.isfinite(bound)))


@lru_cache(maxsize=64)
def _compiled(shape: _Shape) -> tuple[Any, Any, dict[str, Any]]:
    n, m, p = shape.unknowns, shape.equalities, shape.inequalities
    x = cvxpy.Variable(n)
    given: dict[str, Any] = {"q": cvxpy.Parameter(n)}
    objective = given["q"] @ x
    constraints = []
    if shape.quadratic:
        given["root"] = cvxpy.Parameter((n, n))
        objective = objective + 0.5 * cvxpy.sum_squares(given["root"] @ x)
    if m:
        given["A"], given["b"] = cvxpy.Parameter((m, n)), cvxpy.Parameter(m)
        constraints.append(given["A"] @ x == given["b"])
    if p:
        given["G"], given["h"] = cvxpy.Parameter((p, n)), cvxpy.Parameter(p)
        constraints.append(given["G"] @ x <= given["h"])
    if shape.lower:
        given["lb"] = cvxpy.Parameter(len(shape.lower))
        constraints.append(x[list(shape.lower)] >= given["lb"])
    if shape.upper:
        given["ub"] = cvxpy.Parameter(len(shape.upper))
        constraints.append(x[list(shape.upper)] <= given["ub"])
    return cvxpy.Problem(cvxpy.Minimize(objective), constraints), x, given


def _root(P: Array) -> Array:
    """Compute R with R^T R = P for a positive semidefinite P (n, n)."""
    values, vectors = scipy.linalg.eigh(P)
    root: Array = np.sqrt(np.maximum(values, 0.0))[:, None] * vectors.T
    return root
