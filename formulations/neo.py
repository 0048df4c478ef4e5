"""NEO: reactive control with a slack on the task and a reward for manipulability."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated, ClassVar

import numpy as np

from dikbench.errors import DikbenchError
from dikbench.problem import (
    Array,
    DikProblem,
    Drawn,
    LimitKind,
    Limits,
    Parameters,
    ProgramKind,
    QuadraticProgram,
    Range,
    Solve,
)
from formulations.manipulability import (
    columns_before,
    joint_without_gradient,
    manipulability_gradient,
    tracks_whole_pose,
)

LARGEST_SLACK = 10.0
"""Largest slack of each row of the task [m/s; rad/s]."""

SMALLEST_ERROR = 1e-6
"""Value of ||e||_1 (m, rad) below which the price of the slack does not rise."""


@dataclass(frozen=True)
class Neo(Parameters):
    """NEO's program without obstacles: the task has a slack in favour of a better posture.

        min_(v, delta)  1/2 lambda_v ||v||^2 + 1/2 ||delta||^2 / ||e||_1 - k_m J_m^T v
        s.t.            J v + delta = V,   |delta_i| <= 10,   v_min <= v <= v_max,
                        v_i <= eta (rho_i - rho_s)/(rho_0 - rho_s)   within rho_0 of a limit

    J (m, nv), V (m,) and e (m,) are the primary task's (m/s, rad/s; m, rad), in the task frame; v
    in rad/s; J_m the gradient of the manipulability sqrt det(J J^T), (nv,); rho_i the distance to
    the position limit ahead [rad], and likewise below. The price of the slack rises as the error
    falls: the arm first improves its posture and then moves to the target, with direction errors.
    Without the reward where the first priority is not one whole pose. Ignores weights.

    Attributes:
        velocity_weight: lambda_v.
        manipulability_gain: k_m; 0 leaves the manipulability out.
        damper_gain: eta [1/s], the speed at the influence distance [rad/s].
        stop_distance: rho_s [rad].
        influence_distance: rho_0 [rad].
        influence_share: rho_0 over the joint's range in its place; 0: `influence_distance`.

    Source: [HavilandCorke2021]; the share of the range is that of [HavilandCorke2023].
    """

    velocity_weight: Annotated[float, Range(above=0.0), Drawn(1e-3, 0.1, log=True)] = 0.01
    manipulability_gain: Annotated[float, Range(0.0), Drawn(0.0, 3.0)] = 1.0
    damper_gain: Annotated[float, Range(above=0.0, unit="1/s"), Drawn(0.1, 3.0, log=True)] = 1.0
    stop_distance: Annotated[float, Range(0.0, unit="rad"), Drawn(0.01, 0.2)] = 0.05
    influence_distance: Annotated[float, Range(above=0.0, unit="rad"), Drawn(0.3, 1.2)] = 0.9
    influence_share: Annotated[float, Range(0.0, high=0.5)] = 0.0

    program: ClassVar[ProgramKind] = "qp"
    keeps: ClassVar[frozenset[LimitKind]] = frozenset({"velocity"})

    def check(self) -> None:
        """Check that joints are slowed down before they are stopped."""
        near, far = self.stop_distance, self.influence_distance
        if near >= far and not self.influence_share:
            raise DikbenchError(f"stop_distance={near} must be below influence_distance={far}")

    def refuses(self, problem: DikProblem) -> str:
        """Whether the gradient of the manipulability is wanted, and not known."""
        joint = joint_without_gradient(problem.robot) if self._rewards(problem) else ""
        if not joint:
            return ""
        return f"the axes of joint {joint!r} move, valid is: manipulability_gain=0"

    def _rewards(self, problem: DikProblem) -> bool:
        """Say whether the first priority is one whole pose, and its manipulability rewarded."""
        first = [task for task in problem.tasks if task.priority == problem.tasks[0].priority]
        robot = problem.robot
        whole = len(first) == 1 and len(first[0].V) == len(robot.task_rows)
        return self.manipulability_gain > 0 and whole and tracks_whole_pose(robot)

    def velocity(self, problem: DikProblem, solve: Solve) -> Array:
        """See `Formulation`."""
        task = problem.primary
        m, n = task.J.shape
        price = 1 / max(float(np.abs(task.error).sum()), SMALLEST_ERROR)
        # Divided by the price: the same program, better scaled near the target.
        scale = min(1.0, 1 / price)
        P = np.diag(scale * np.concatenate([np.full(n, self.velocity_weight), np.full(m, price)]))
        q = np.zeros(n + m)
        if self._rewards(problem):
            gradient = manipulability_gradient(task.J, columns_before(problem.robot))
            q[:n] = -scale * self.manipulability_gain * gradient
        lower, upper = self._bounds(problem.limits)
        slack = np.full(m, LARGEST_SLACK)
        A = np.hstack([task.J, np.eye(m)])
        x = solve(
            QuadraticProgram(
                P,
                q,
                A=A,
                b=task.V,
                lb=np.concatenate([lower, -slack]),
                ub=np.concatenate([upper, slack]),
            )
        )
        return x[:n]

    def _bounds(self, limits: Limits) -> tuple[Array, Array]:
        """Compute velocity limits with dampers, (nv,) [rad/s]; at least rest from outside."""
        n, velocity = limits.joint.nv, limits.joint.velocity
        lower = np.full(n, -np.inf) if velocity is None else velocity.lower
        upper = np.full(n, np.inf) if velocity is None else velocity.upper
        if limits.to_lower is not None and limits.to_upper is not None:
            influence = self._influence(limits)
            lower = np.maximum(lower, -self._damper(limits.to_lower, -lower, influence))
            upper = np.minimum(upper, self._damper(limits.to_upper, upper, influence))
        return lower, upper

    def _influence(self, limits: Limits) -> Array:
        """Compute rho_0 of each joint, (nv,) [rad]; 0 for one that turns without end."""
        position = limits.joint.position
        if not self.influence_share or position is None:
            return np.full(limits.joint.nv, self.influence_distance)
        reach = self.influence_share * (position.upper - position.lower)
        return np.where(np.isfinite(reach), np.maximum(reach, self.stop_distance), 0.0)

    def _damper(self, distance: Array, free: Array, influence: Array) -> Array:
        """Compute the speed allowed towards a limit at a distance, (nv,) [rad/s]."""
        span = np.maximum(influence - self.stop_distance, np.finfo(float).tiny)
        slowed = self.damper_gain * np.maximum((distance - self.stop_distance) / span, 0.0)
        return np.where(distance < influence, slowed, free)
