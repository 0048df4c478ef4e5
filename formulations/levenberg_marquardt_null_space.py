"""Levenberg-Marquardt whose null space leads away from joint limits and singularities."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated, ClassVar

import numpy as np

from dikbench.problem import (
    Array,
    DikProblem,
    Drawn,
    Limits,
    Parameters,
    ProblemPart,
    Range,
    Solve,
    least_norm,
    times,
)
from formulations.levenberg_marquardt import LevenbergMarquardt
from formulations.manipulability import (
    columns_before,
    joint_without_gradient,
    tracks_whole_pose,
)
from formulations.manipulability_gradients import manipulability_gradients


@dataclass(frozen=True)
class LevenbergMarquardtNullSpace(Parameters):
    """Levenberg-Marquardt, and in the null space away from joint limits, or to manipulability.

        v = v_LM + (I - J^+ J) (k_S S(q) + k_m J_m),   v_LM as `lm` has it
        S_i = ((rho_i - rho_0)/(rho_0 - rho_s))^2 away from a limit at a distance rho_i <= rho_0

    and 0 elsewhere; rho_0 is a share of the joint's range (a range narrower than rho_s has no
    push), J_m (nv,) the gradient of the manipulability sqrt det(J J^T). J (m, nv), V (m,), the
    error (m,) and the weights are the primary task's, in the task frame; v in rad/s. The
    pseudo-inverse with error_factor and damping 0. Keeps away from limits as far as the null space
    allows, but does not keep them: the push has its full size at the limit itself whatever the time
    step, and at a wrong gain it keeps the arm from settling. J_m is left out where the first
    priority is not one whole pose. Ignores limits otherwise, and other tasks.

    Attributes:
        error_factor: see `lm`.
        damping: see `lm`.
        limit_gain: k_S, the speed at a limit [rad/s]; the source's 1/lambda_Sigma.
        manipulability_gain: k_m, the source's 1/lambda_m; 0 leaves it out.
        stop_distance: rho_s [rad], the distance at which the push has its full size.
        influence_share: rho_0 over the joint's range, at most its half.
        rank_tolerance: singular values of J up to this count as zero (absolute, units of J).

    Source: [HavilandCorke2023], after Baur et al. (2012).
    """

    error_factor: Annotated[float, Range(0.0), Drawn(1e-2, 100.0, log=True)] = 1.0
    damping: Annotated[float, Range(0.0), Drawn(1e-4, 0.1, log=True)] = 0.01
    limit_gain: Annotated[float, Range(0.0, unit="rad/s"), Drawn(1e-3, 1.0, log=True)] = 0.1
    manipulability_gain: Annotated[float, Range(0.0), Drawn(0.0, 3.0)] = 0.0
    stop_distance: Annotated[float, Range(0.0, unit="rad")] = 0.001
    influence_share: Annotated[float, Range(above=0.0, high=0.5), Drawn(0.05, 0.5)] = 0.5
    rank_tolerance: Annotated[float, Range(0.0)] = 1e-6

    batched: ClassVar[bool] = True
    sees: ClassVar[frozenset[ProblemPart]] = frozenset({"weights"})

    def refuses(self, problem: DikProblem) -> str:
        """Whether the gradient of the manipulability is wanted, and not known."""
        joint = joint_without_gradient(problem.robot) if self._rewards(problem) else ""
        return joint and f"the axes of joint {joint!r} move, valid is: manipulability_gain=0"

    def _rewards(self, problem: DikProblem) -> bool:
        """Say whether the first priority is one whole pose, and its manipulability rewarded."""
        first = [task for task in problem.tasks if task.priority == problem.tasks[0].priority]
        robot = problem.robot
        whole = len(first) == 1 and first[0].V.shape[-1] == len(robot.task_rows)
        return self.manipulability_gain > 0 and whole and tracks_whole_pose(robot)

    def velocity(self, problem: DikProblem, solve: Solve) -> Array:
        """See `Formulation`."""
        v = LevenbergMarquardt(self.error_factor, self.damping).velocity(problem, solve)
        J = problem.primary.J
        push = self.limit_gain * self._away_from_limits(problem.limits, v)
        if self._rewards(problem):
            gradient = manipulability_gradients(
                J.reshape(-1, *J.shape[-2:]), columns_before(problem.robot)
            )
            push += self.manipulability_gain * gradient.reshape(v.shape)
        v += push - least_norm(J, times(J, push), self.rank_tolerance)
        return v

    def _away_from_limits(self, limits: Limits, v: Array) -> Array:
        """Compute S, as many as v has, (nv,) or (N, nv); 0 without position limits in force."""
        joint, below, above = limits.joint, limits.to_lower, limits.to_upper
        if joint.position is None or below is None or above is None:
            return np.zeros_like(v)
        reach = self.influence_share * (joint.position.upper - joint.position.lower)
        limited = np.isfinite(reach) & (reach > self.stop_distance)
        reach = np.where(limited, reach, self.stop_distance + 1.0)
        size = reach - self.stop_distance
        up, down = (
            (np.minimum(np.where(limited, distance, reach) - reach, 0.0) / size) ** 2
            for distance in (below, above)
        )
        away: Array = up - down
        return away
