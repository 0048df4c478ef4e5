"""The weighted quadratic program with limits."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated, ClassVar

from dikbench.problem import (
    Array,
    Braking,
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
)


@dataclass(frozen=True)
class WeightedQp(Parameters):
    """Weighted quadratic program: all tasks at once, inside the limits.

        min_v  sum_i 1/2 ||J_i v - V_i||^2_(W_i) + 1/2 lambda^2 ||v||^2
        s.t.   lo <= v <= hi   (the velocity box: position, velocity and acceleration limits)
               G v <= h        (torques and distances, where the scenario bounds them)

    over all tasks i, with W_i the task's weights (ignoring priorities); poses in the task
    frame; v in rad/s. With no bound active, one task and W = I it is damped least squares.
    With `log_derivative` both sides of a pose task are multiplied by Jlog6. Keeps every limit, with
    direction errors near a limit or a singularity.

    Attributes:
        damping: lambda, unsquared; not zero by default, else the minimiser is not unique on a
            redundant arm.
        braking: how the box approaches a position limit (see `dikbench.problem.velocity_box`).
        position_gain: share of the distance to a limit per step under `gain` braking.
        log_derivative: whether to multiply tasks by the derivative of their logarithm.

    Source: [Tedrake], chapter 3; [Pink] for the log-derivative.
    """

    damping: Annotated[float, Range(0.0), Drawn(1e-4, 0.1, log=True)] = 1e-3
    braking: Braking = "viable"
    position_gain: Annotated[float, Range(above=0.0, high=1.0), Drawn(0.1, 1.0)] = 0.5
    log_derivative: bool = False

    program: ClassVar[ProgramKind] = "qp"
    keeps: ClassVar[frozenset[LimitKind]] = frozenset(
        {"position", "velocity", "acceleration", "inequalities"}
    )
    sees: ClassVar[frozenset[ProblemPart]] = frozenset({"lower-tasks", "weights"})

    @property
    def batched(self) -> bool:
        """Without the derivative of the logarithm, which is computed for one placement."""
        return not self.log_derivative

    def velocity(self, problem: DikProblem, solve: Solve) -> Array:
        """See `Formulation`."""
        first, *others = problem.tasks
        P, pull = first.normal_equations(log_derivative=self.log_derivative)
        P = P + scaled_identity(problem.robot.nv, self.damping**2)
        for task in others:
            H, g = task.normal_equations(log_derivative=self.log_derivative)
            P = P + H
            pull = pull + g
        box = problem.box(self.braking, self.position_gain)
        return solve(QuadraticProgram(P, -pull, problem.G, problem.h, lb=box.lower, ub=box.upper))
