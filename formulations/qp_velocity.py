"""A quadratic program with velocity bounds only, as lectures introduce it."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated, ClassVar

from dikbench.problem import (
    Array,
    DikProblem,
    Drawn,
    LimitKind,
    Parameters,
    ProgramKind,
    QuadraticProgram,
    Range,
    Solve,
    product,
    scaled_identity,
    times,
    transposed,
)


@dataclass(frozen=True)
class QpVelocity(Parameters):
    """Least squares inside the velocity limits, the first step from the pseudo-inverse to `qp`.

        min_v  1/2 ||J v - V||^2 + 1/2 lambda^2 ||v||^2   s.t.   v_min <= v <= v_max

    J (m, nv) and V (m,) are the primary task's, in the task frame; v in rad/s. Direction errors
    where a bound is active; passes position limits. Ignores weights and other tasks.

    Attributes:
        damping: lambda, unsquared; not zero by default, else the minimiser is not unique on a
            redundant arm.

    Source: [Tedrake] (the quadratic program with velocity constraints).
    """

    damping: Annotated[float, Range(0.0), Drawn(1e-4, 0.1, log=True)] = 1e-3

    program: ClassVar[ProgramKind] = "qp"
    keeps: ClassVar[frozenset[LimitKind]] = frozenset({"velocity"})

    batched: ClassVar[bool] = True

    def velocity(self, problem: DikProblem, solve: Solve) -> Array:
        """See `Formulation`."""
        J, n = problem.primary.J, problem.robot.nv
        Jt = transposed(J)
        P, q = product(Jt, J) + scaled_identity(n, self.damping**2), -times(Jt, problem.primary.V)
        limit = problem.limits.joint.velocity
        if limit is None:
            return solve(QuadraticProgram(P, q))
        return solve(QuadraticProgram(P, q, lb=limit.lower, ub=limit.upper))
