"""The quadratic program of Pink."""

from __future__ import annotations

from dataclasses import dataclass

from formulations.displacement_qp import DisplacementQp


@dataclass(frozen=True)
class PinkQp(DisplacementQp):
    """The quadratic program as Pink poses it: all tasks at once, with the logarithm's derivative.

        min_v  sum_i 1/2 ||Jl_i (J_i v - V_i)||^2_(W_i) + 1/2 (lambda^2 + mu_i) ||v||^2
        s.t.   g (q_min - q)/dt <= v <= g (q_max - q)/dt,   v_min <= v <= v_max,   g = position_gain

    over all tasks i (ignoring priorities), poses in the task frame, v in rad/s; W_i is the
    task's weight (Pink's cost squared), Jl_i = Jlog6 of a pose task, mu_i = lm_damping dt^2
    ||V_i||^2_(W_i). Pink's own gain 1 reaches the target within one step, here a gain of
    1/dt; the task's gain is used instead. Acceleration limits in force bound v as well, with Pink's
    braking bound sqrt(2 a d) (see `DisplacementQp`). With hardly any damping only the limits
    in force bound the velocities near a singularity.

    Attributes:
        damping: lambda, unsquared; Pink adds lambda^2 = 1e-12.
        lm_damping: factor of the damping by the squared error of pose tasks.
        position_gain: share of the distance to a position limit per step.

    Source: [Pink] 4.4, solve_ik.
    """

    position_gain: float = 0.5
