"""Drake's system: least squares with centring inside velocity bounds that shrink near limits."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated, ClassVar

import numpy as np
import pinocchio as pin

from dikbench.problem import (
    Array,
    DikProblem,
    Drawn,
    LimitKind,
    Limits,
    Parameters,
    ProblemPart,
    ProgramKind,
    QuadraticProgram,
    Range,
    Solve,
)
from formulations.drake import angular_first, posture_of
from formulations.lu_kernel import lu_kernel

STOP_RAD = 0.0025
"""Distance to a limit below which a joint does not move towards it."""

INFLUENCE_RAD = 0.1
"""Distance to a limit below which a joint is slowed down."""


@dataclass(frozen=True)
class DrakeSystem(Parameters):
    """Least squares and joint centring, as Drake's system of 2025 poses it; no alpha.

        min_v  G ||J v - V||^2 + ||P (v - K e)||^2
        s.t.   s_lo v_min <= v <= s_hi v_max,   s = clamp((d - 0.0025)/(0.1 - 0.0025), 0, 1)

    J (m, nv) and V (m,) are the primary task's, in the task frame; v in rad/s; e = q_nom - q is the
    error of the problem's posture task, (nv,) (zero where there is none); P the kernel of J by a
    full-pivoting LU, as in `drake`, but of a J in the axes of the world, as in the system (the
    pivots and the length of P's rows depend on the axes); d the distance to the nearer position
    limit [rad], on whose side alone the bound is scaled. Keeps the velocity limits and, at ordinary
    speeds, the position limits; outside a limit a joint may stay there. Direction errors where
    bounds are active. Ignores weights.

    Attributes:
        tracking_weight: G; Drake's own default is 1, its manual advises 100.
        centering: K [1/s].

    Source: [Drake], DifferentialInverseKinematicsSystem (its recipe of least squares, joint
    centring and joint velocity limits).
    """

    tracking_weight: Annotated[float, Range(above=0.0), Drawn(1.0, 1e4, log=True)] = 100.0
    centering: Annotated[float, Range(0.0, unit="1/s"), Drawn(0.0, 10.0)] = 1.0

    program: ClassVar[ProgramKind] = "qp"
    keeps: ClassVar[frozenset[LimitKind]] = frozenset({"velocity"})

    @property
    def sees(self) -> frozenset[ProblemPart]:
        """The posture, where joints are drawn to one."""
        return frozenset({"postures"}) if self.centering else frozenset()

    def velocity(self, problem: DikProblem, solve: Solve) -> Array:
        """See `Formulation`."""
        J, V = problem.primary.J, problem.primary.V
        P = J.T @ J
        q = -J.T @ V
        kernel = lu_kernel(angular_first(_in_world_axes(problem, J)))
        if kernel.size:
            centred = kernel @ kernel.T / self.tracking_weight
            P += centred
            q -= centred @ (self.centering * posture_of(problem)[1])
        lower, upper = scaled_bounds(problem.limits)
        return solve(QuadraticProgram(P, q, lb=lower, ub=upper))


def _in_world_axes(problem: DikProblem, J: Array) -> Array:
    """Turn a pose's Jacobian (6, nv) into the axes of the world; leave any other one."""
    if len(J) != 6:
        return J
    robot = problem.robot
    pin.forwardKinematics(robot.model, robot.scratch, problem.q)
    R = pin.updateFramePlacement(robot.model, robot.scratch, robot.frame_id).rotation
    return np.vstack([R @ J[:3], R @ J[3:]])


def scaled_bounds(limits: Limits) -> tuple[Array, Array]:
    """Compute velocity bounds (nv,) [rad/s], the one towards the nearer limit scaled down."""
    velocity = limits.joint.velocity
    if velocity is None:
        n = limits.joint.nv
        return np.full(n, -np.inf), np.full(n, np.inf)
    if limits.to_lower is None or limits.to_upper is None:
        return velocity.lower, velocity.upper
    nearer = limits.to_lower < limits.to_upper
    distance = np.minimum(limits.to_lower, limits.to_upper)
    scale = np.clip((distance - STOP_RAD) / (INFLUENCE_RAD - STOP_RAD), 0.0, 1.0)
    lower = np.where(nearer, _scaled(velocity.lower, scale), velocity.lower)
    return lower, np.where(nearer, velocity.upper, _scaled(velocity.upper, scale))


def _scaled(bound: Array, scale: Array) -> Array:
    """Multiply a bound (nv,), infinite or not, by a share (nv,); nothing of infinity is nothing."""
    return np.multiply(bound, scale, out=np.zeros_like(bound), where=scale > 0)
