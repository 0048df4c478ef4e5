"""Programs whose solution is known without a solver, and what the libraries of solvers warn of."""

from __future__ import annotations

import contextlib
from typing import Final

import numpy as np
import pytest

from dikbench.arrays import Array
from dikbench.errors import CannotAnswer
from dikbench.programs.answer import Answer
from dikbench.programs.quadratic_program import ProgramKind, QuadraticProgram
from dikbench.solvers.catalogue.back_ends import BACK_ENDS, is_installed, parse_solver
from dikbench.solvers.checked_solve import CheckedSolve, make_solve
from dikbench.solvers.recheck.residuals import Residuals, residuals
from dikbench.solvers.recheck.stack import Stack

LIBRARIES_WARN: Final = [
    pytest.mark.filterwarnings(r"ignore::UserWarning:qpsolvers\."),
    pytest.mark.filterwarnings(
        r"ignore::UserWarning:cvxpy\.|dikbench\.solvers\.interfaces\.through_cvxpy"
    ),
]
"""Marks of modules in which solvers fail. The libraries warn beside each failure;
`dikbench.solvers` silences them, pytest resets that."""

INSTALLED: Final = [name for name in BACK_ENDS if is_installed(name)]

ACCURACY: Final = 5e-3
"""The loosest default tolerance (OSQP's 1e-3), with room for the conditioning of the examples."""


def solve_with(selector: str, program: ProgramKind = "qp") -> CheckedSolve:
    """Make the solve of a solver."""
    return make_solve(parse_solver(selector), program)


def projection() -> tuple[QuadraticProgram, Array]:
    """Find the point of the box [0, 1]^3 that is nearest to c: c clipped."""
    c = np.array([0.5, 2.0, -3.0])
    return QuadraticProgram(np.eye(3), -c, lb=np.zeros(3), ub=np.ones(3)), np.clip(c, 0, 1)


def mixture() -> tuple[QuadraticProgram, Array]:
    """Put everything together, the optimum from its multipliers.

    x = (1, 0, 0.5): the upper bound of x_1 active (multiplier 2), the lower one of x_2 (-3), the
    inequality x_1 + x_3 <= 1.5 active (0.5) and x_1 + x_2 - x_3 = 0.5 (-1), so that
    q = -(P x + G'z + A'y + w).
    """
    P, x = np.diag([1.0, 2.0, 4.0]), np.array([1.0, 0.0, 0.5])
    G, A = np.array([[1.0, 0.0, 1.0]]), np.array([[1.0, 1.0, -1.0]])
    q = -(P @ x + G.T @ [0.5] + A.T @ [-1.0] + np.array([2.0, -3.0, 0.0]))
    bounds = {"lb": np.array([-1.0, 0.0, -1.0]), "ub": np.array([1.0, 1.0, 1.0])}
    return QuadraticProgram(P, q, G, np.array([1.5]), A, np.array([0.5]), **bounds), x


def scaling() -> tuple[QuadraticProgram, Array]:
    """Take the shape of alpha scaling: max alpha, v = alpha (1, 4), |v| <= 2: alpha = 1/2."""
    A = np.array([[1.0, 0.0, -1.0], [0.0, 1.0, -4.0]])
    bounds = {"lb": np.array([-2.0, -2.0, 0.0]), "ub": np.array([2.0, 2.0, 1.0])}
    program = QuadraticProgram(
        np.zeros((3, 3)), np.array([0.0, 0.0, -1.0]), A=A, b=np.zeros(2), **bounds
    )
    return program, np.array([0.5, 2.0, 0.5])


def no_point() -> QuadraticProgram:
    """Ask for x_1 + x_2 = 3 with |x_i| <= 1."""
    A = np.array([[1.0, 1.0]])
    return QuadraticProgram(
        np.eye(2), np.zeros(2), A=A, b=np.array([3.0]), lb=-np.ones(2), ub=np.ones(2)
    )


def residuals_of(program: QuadraticProgram, answer: Answer) -> Residuals:
    """The residuals of one answer, (1,) each."""
    found = residuals(Stack([program], [answer]))
    for part in ("primal", "dual", "gap", "nearness"):
        assert getattr(found, part).shape == (1,), part
    return found


def one_bound() -> QuadraticProgram:
    """Min 1/2 x^2 - 2 x on [0, 1]: x = 1 with the multiplier 1 of the upper bound."""
    return QuadraticProgram(np.eye(1), np.array([-2.0]), lb=np.zeros(1), ub=np.ones(1))


class ScriptedSolver:
    """A back end that reads its answers off a list, and notes from which call they were asked."""

    def __init__(self, *answers: Answer) -> None:
        self.answers = list(answers)
        self.sites: list[int] = []

    def __call__(self, program: object, site: int) -> Answer:
        """Return the next answer."""
        self.sites.append(site)
        return self.answers.pop(0)


def said(x: float, multiplier: float | None = None, *, claimed: bool = True) -> Answer:
    """Make an answer to `one_bound`, with the multiplier of its bounds where it is known."""
    z_box = None if multiplier is None else np.array([multiplier])
    return Answer(np.array([x]), claimed, z_box=z_box, core_ns=1000)


def ask(solve: CheckedSolve, program: QuadraticProgram) -> None:
    """Solve a program, whatever comes of it."""
    with contextlib.suppress(CannotAnswer):
        solve(program)
