"""A path on which the least-norm motion leaves a joint's range, and another motion does not."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from math import pi
from types import MappingProxyType
from typing import Annotated, Literal

import numpy as np
import pinocchio as pin

from dikbench.errors import DikbenchError
from dikbench.problem import Array, Drawn, Kinematics, Range, Robot, null_space
from dikbench.scenario import (
    Case,
    Claim,
    NamedRobotFamily,
    Perturbation,
    Variation,
    joint_oracle,
    joint_path,
    placement_of,
    solve_placement,
    there_and_back,
    usual_claims,
)


@dataclass(frozen=True)
class Detour:
    """Where a robot's null space spares a joint.

    Attributes:
        posture: posture of the other joints at the start [rad] (the spared joint's is ignored).
        joint: the joint that the least-norm motion moves out of its range (index into v).
        side: towards its upper limit (1) or its lower one (-1).
    """

    posture: tuple[float, ...]
    joint: int
    side: int


DETOURS: Mapping[str, Detour] = MappingProxyType(
    {
        "panda": Detour((2.82, -0.26, 0.58, -1.98, 0.62, 1.85, 0.88), 0, 1),
        "xarm7": Detour((0.81, -0.6, -0.44, 0.9, -1.0, -1.61, -1.66), 5, -1),
        "lwr": Detour((0.02, 0.86, -0.08, 0.86, 2.89, 0.34, 0.46), 4, 1),
        "tiago": Detour((1.35, -0.19, -1.08, 1.46, -0.05, 1.33, 0.11), 5, 1),
        "talos": Detour((-0.67, 1.42, 2.36, -1.63, -1.01, 0.3, -0.04), 2, 1),
    }
)
"""Random postures; each certifies with five pairs of approach and depth, with eight seeds each."""

STEP_RAD = 0.02
"""Step along the path in which the least-norm motion is followed out of the limit."""

LONGEST_WAY_RAD = 2.0
"""Longest way of the joints, in rad of the joint that they replace."""


@dataclass(frozen=True, kw_only=True)
class JointLimitDetour(NamedRobotFamily):
    """A path on which the least-norm motion leaves a joint's range; another motion keeps it.

    On an arm with seven joints, z in the null space of the task, the joints move as
    q(t) = q_0 + sin^2(pi t/T) a (e_j - z/z_j) and the task frame follows: to first order as if
    joint j alone moved, which rests at the distance `approach` from its limit. The least-norm
    motion along the same path moves it, and is `depth` outside half way, which decides a. So the
    limits can be kept by the clock, by who uses the null space for it. A seed moves the other
    joints by up to 0.05 rad and changes the duration by up to 10 %.

    Provokes: a position limit that only the null space can keep

    Shows in: position_violation_max_rad, position_error_max_m, velocity_peak_ratio

    Attributes:
        robot: an arm with seven joints.
        approach: distance of the joint from its limit.
        depth: largest distance of the least-norm motion beyond the limit.
        speed: peak of the joint speeds over their limits, of the motion that keeps them.

    Source: by construction; Liegeois 1977 (the null space avoids joint limits); Flacco, De Luca &
    Khatib 2015.
    """

    robot: Literal["panda", "xarm7", "lwr", "tiago", "talos"] = "panda"
    approach: Annotated[float, Range(0.02, 0.3, "rad"), Drawn(0.03, 0.15)] = 0.08
    depth: Annotated[float, Range(0.05, 0.3, "rad"), Drawn(0.06, 0.2)] = 0.12
    speed: Annotated[float, Range(0.05, 0.9), Drawn(0.2, 0.8)] = 0.5

    variation = Variation(start=0.05, timing=0.1)
    about_position_limits = True

    def case(self, robot: Robot, change: Perturbation) -> Case:
        """See `Family`."""
        position, velocity = robot.limits.position, robot.limits.velocity
        if position is None or velocity is None:
            raise DikbenchError(f"robot {self.robot} has no position limits")
        where = DETOURS[self.robot]
        j, side = where.joint, where.side
        limit = position.upper[j] if side > 0 else position.lower[j]
        start = change.posture(robot, np.array(where.posture), (j,)).copy()
        start[j] = limit - side * self.approach
        way = side * _instead_of(robot, start, j)
        offset = way * _length(robot, start, way, limit + side * self.depth, where)
        peak = self.speed / change.pace
        duration = pi * float((np.abs(offset) / velocity.upper).max()) / peak
        q_r, v_r = there_and_back(robot, start, offset, duration)
        reference = joint_path(robot, q_r, v_r, duration)
        motion = joint_oracle(robot, q_r, np.linspace(0.0, duration, 201))
        least_norm = self.exact_motion(robot, reference, start)
        claims = (
            Claim(
                "margin of the least-norm motion [rad]",
                least_norm.margin.min(),
                -1.5 * self.depth,
                -0.8 * self.depth,
            ),
            Claim("its smallest singular value (m, rad)", least_norm.sigma_min.min(), 0.03),
            *usual_claims(
                motion,
                speed=(0.9 * peak, 1.05 * peak),
                sigma_min=0.03,
                margin=0.9 * min(self.approach, 0.1),
            ),
        )
        return Case(reference, start, motion, claims, v0=v_r(0.0), situation="at joint limits")


def _instead_of(robot: Robot, q: Array, joint: int) -> Array:
    """Compute the joint velocity (nv,) with the effect of a joint's, at which it rests."""
    kinematics, one = Kinematics(robot), np.zeros(robot.nv)
    kinematics.update(q)
    z, one[joint] = null_space(kinematics.jacobian(robot.frame_id), 1e-6)[:, 0], 1.0
    way: Array = one - z / z[joint]
    return way


def _length(robot: Robot, start: Array, way: Array, stop: float, where: Detour) -> float:
    """Compute the length of the way after which the least-norm motion has a joint at `stop` [rad].

    Raises:
        DikbenchError: if it does not get there.
    """
    q, j, length = start, where.joint, 0.0
    while length < LONGEST_WAY_RAD:
        target = placement_of(robot, pin.integrate(robot.model, start, (length + STEP_RAD) * way))
        before, q = q, solve_placement(robot, target, q)
        if where.side * (q[j] - stop) >= 0:
            return length + STEP_RAD * float((stop - before[j]) / (q[j] - before[j]))
        length += STEP_RAD
    raise DikbenchError(f"the least-norm motion keeps joint {j + 1} inside; it is at {q[j]:.3g}")
