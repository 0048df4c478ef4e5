"""The program of Pink and mink in velocities, which differ in gains and damping."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated, ClassVar

import numpy as np

from dikbench.problem import (
    Array,
    DikProblem,
    Drawn,
    LimitKind,
    Parameters,
    ProblemPart,
    ProgramKind,
    QuadraticProgram,
    Range,
    Solve,
    scaled_identity,
    sqrt_brake,
)


@dataclass(frozen=True)
class DisplacementQp(Parameters):
    """A program that is posed in displacements Delta q = v dt, divided by dt^2.

        min_v  sum_i 1/2 ||Jl_i (J_i v - V_i)||^2_(W_i) + 1/2 (lambda^2 + mu_i) ||v||^2
        s.t.   max(gain (q_min - q)/dt, v_min) <= v <= min(gain (q_max - q)/dt, v_max)

    with Jl_i the derivative of the task's logarithm and mu_i = lm_damping dt^2 ||V_i||^2_(W_i): P
    is theirs, q and h are theirs over dt. With acceleration limits in force also
    v_prev + a_min dt <= v <= v_prev + a_max dt and v <= sqrt(2 a d) at a distance d from a limit.
    All tasks have their weights; priorities are ignored.

    Attributes:
        damping: lambda, unsquared.
        lm_damping: factor of the damping by the squared error, of every pose task.
        position_gain: share of the distance to a position limit per step.
    """

    damping: Annotated[float, Range(0.0), Drawn(1e-6, 0.1, log=True)] = 1e-6
    lm_damping: Annotated[float, Range(0.0), Drawn(1e-3, 10.0, log=True)] = 0.0
    position_gain: Annotated[float, Range(above=0.0, high=1.0), Drawn(0.1, 1.0)] = 0.5

    program: ClassVar[ProgramKind] = "qp"
    keeps: ClassVar[frozenset[LimitKind]] = frozenset({"position", "velocity", "acceleration"})
    sees: ClassVar[frozenset[ProblemPart]] = frozenset({"lower-tasks", "weights"})

    def velocity(self, problem: DikProblem, solve: Solve) -> Array:
        """See `Formulation`."""
        n = problem.robot.nv
        P = scaled_identity(n, self.damping**2)
        q = np.zeros(n)
        for task in problem.tasks:
            H, g = task.normal_equations(log_derivative=True)
            P = P + H
            q -= g
            if self.lm_damping and task.log_derivative is not None:
                mu = self.lm_damping * problem.dt**2 * float((task.weight * task.V) @ task.V)
                P = P + mu * scaled_identity(n, 1.0)
        box = problem.box("gain", self.position_gain)
        lower, upper = box.lower, box.upper
        acceleration, limits = problem.limits.joint.acceleration, problem.limits
        if acceleration is not None and limits.to_lower is not None and limits.to_upper is not None:
            lower = np.maximum(lower, -_braking(limits.to_lower, acceleration.upper, problem.dt))
            upper = np.minimum(upper, _braking(limits.to_upper, -acceleration.lower, problem.dt))
        return solve(QuadraticProgram(P, q, lb=lower, ub=upper))


def _braking(distance: Array, deceleration: Array, dt: float) -> Array:
    """Compute sqrt(2 a d), (nv,) [rad/s]; infinite outside, where the box leads back."""
    return np.where(distance < 0, np.inf, sqrt_brake(distance, deceleration, dt))
