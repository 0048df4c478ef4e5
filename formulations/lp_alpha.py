"""Scale the desired motion down until it is feasible, as a linear program."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated, ClassVar

import numpy as np

from dikbench.problem import (
    Array,
    Box,
    Braking,
    DikProblem,
    Drawn,
    LimitKind,
    LinearizedTask,
    Parameters,
    ProgramKind,
    QuadraticProgram,
    Range,
    Solve,
)


@dataclass(frozen=True)
class LpAlpha(Parameters):
    """Alpha scaling: move in the desired direction, as fast as the limits allow.

        max_(v, alpha)  alpha - 1/2 rho ||v||^2
        s.t.            J v = alpha V,   0 <= alpha <= 1,   lo <= v <= hi   (the velocity box),
                        G v <= h   (torques and distances, where the scenario bounds them)

    J (m, nv) and V (m,) are the primary task's, in the task frame; v in rad/s. A linear program
    where rho = 0; its vertices are not unique where the arm has a null space, and v then chatters.
    A small rho avoids that at the cost of at most rho/2 ||v||^2 of alpha. No direction errors and
    inside every limit; slows down, and where the desired direction is lost the frame stops (with
    rho = 0 the joints need not: alpha = 0 leaves the null space of a singular J free). Ignores
    weights.

    Attributes:
        regularization: rho; None: 1e-4 if the arm has more joints than the task has rows, else 0.
        braking: how the box approaches a position limit (see `dikbench.problem.velocity_box`).

    Source: [Tedrake], chapter 3.
    """

    regularization: Annotated[float | None, Range(0.0), Drawn(1e-6, 1e-2, log=True)] = None
    braking: Braking = "viable"

    program: ClassVar[ProgramKind] = "lp"
    keeps: ClassVar[frozenset[LimitKind]] = frozenset(
        {"position", "velocity", "acceleration", "inequalities"}
    )

    batched: ClassVar[bool] = True

    def velocity(self, problem: DikProblem, solve: Solve) -> Array:
        """See `Formulation`."""
        task = problem.primary
        rho = regularization_for(task, self.regularization)
        x = solve(alpha_program(task, problem.box(self.braking), rho, problem.G, problem.h))
        return x[..., : problem.robot.nv]


def regularization_for(task: LinearizedTask, given: float | None) -> float:
    """Return rho: as given, else 1e-4 where the task leaves joints free and 0 elsewhere."""
    if given is not None:
        return given
    m, n = task.J.shape[-2:]
    return 1e-4 if n > m else 0.0


def alpha_program(
    task: LinearizedTask,
    box: Box,
    regularization: float,
    G: Array | None = None,
    h: Array | None = None,
) -> QuadraticProgram:
    """Pose the program of `LpAlpha` in matrices, in x = (v, alpha), shape (nv + 1,).

    Of many control steps as well (see `DikProblem`); the cost is the same for all.
    """
    *rows, m, n = task.J.shape
    P = np.zeros((n + 1, n + 1))
    P.flat[: n * (n + 2) : n + 2] = regularization
    q = np.zeros(n + 1)
    q[n] = -1.0
    A = np.empty((*rows, m, n + 1))
    A[..., :n] = task.J
    A[..., n] = -task.V
    lower, upper = np.zeros((*rows, n + 1)), np.ones((*rows, n + 1))
    lower[..., :n], upper[..., :n] = box.lower, box.upper
    padded = None if G is None else np.pad(G, ((0, 0), (0, 1)))
    return QuadraticProgram(P, q, padded, h, A, np.zeros(m), lower, upper)
