"""The pseudo-inverse, slowed down towards a singularity."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated, Literal

import pinocchio as pin

from dikbench.errors import DikbenchError
from dikbench.problem import (
    Array,
    DikProblem,
    Drawn,
    LimitKind,
    Parameters,
    Range,
    Robot,
    Solve,
    least_norm,
    thin_svd,
)
from formulations.pseudo_inverse import scaled


@dataclass(frozen=True)
class ConditionGovernor(Parameters):
    """Condition-number governor: slow down towards a singularity, stop before it, leave freely.

        v = c J^+ V,   kappa = sigma_1/sigma_m
        c = min(1, max(0, (kappa_stop - kappa)/(kappa_stop - kappa_slow)))  if dkappa/dt > 0, else 1

    then `after`: nothing, or scaled down into the velocity limits. J (m, nv) and V (m,) are the
    primary task's, in the task frame; v in rad/s. kappa and its derivative along J^+ V are those of
    the robot's task frame (body Jacobian, units m and rad), whatever the task. No direction
    errors; it stops for good before a singularity on its path. Leaving is not slowed down, so that
    it cannot get stuck there. Ignores weights.

    The source tests whether the motion approaches by a step along u_m; here
    dsigma_i/dt = u_i^T dJ/dt v_i is exact. Its later versions also slow leaving down, over twice
    the range, and stop above kappa_stop whatever the direction.

    Attributes:
        slow: kappa_slow, where slowing down begins; at their safe starts the arms here have 7 to 18
            (TIAGo and the LWR are beyond the default).
        stop: kappa_stop, where approaching ends.
        after: what to do with a velocity outside the limits; the source scales.
        rank_tolerance: singular values up to this count as zero (absolute, units of J); such a
            frame is at its singularity and is not slowed down.

    Source: [MoveItServo], first version.
    """

    slow: Annotated[float, Range(1.0), Drawn(5.0, 30.0, log=True)] = 17.0
    stop: Annotated[float, Range(1.0), Drawn(30.0, 200.0, log=True)] = 30.0
    after: Literal["none", "scale"] = "scale"
    rank_tolerance: Annotated[float, Range(0.0)] = 1e-6

    def check(self) -> None:
        """Check that slowing down begins before approaching ends."""
        if self.slow >= self.stop:
            raise DikbenchError(f"slow={self.slow} must be below stop={self.stop}")

    @property
    def keeps(self) -> frozenset[LimitKind]:
        """The velocity limits, unless nothing is done after the inverse."""
        return frozenset() if self.after == "none" else frozenset({"velocity"})

    def velocity(self, problem: DikProblem, solve: Solve) -> Array:
        """See `Formulation`."""
        task = problem.primary
        v = least_norm(task.J, task.V, self.rank_tolerance)
        v *= self._scale(problem.robot, problem.q, v)
        limit = problem.limits.joint.velocity
        return v if self.after == "none" or limit is None else scaled(v, limit)

    def _scale(self, robot: Robot, q: Array, v: Array) -> float:
        """Compute the factor c for a velocity (nv,) at a configuration (nq,)."""
        rows, data = list(robot.task_rows), robot.scratch
        pin.computeJointJacobiansTimeVariation(robot.model, data, q, v)
        axes = pin.LOCAL if robot.task_axes == "body" else pin.LOCAL_WORLD_ALIGNED
        local = (robot.model, data, robot.frame_id, axes)
        # Pinocchio returns a vector for a single joint.
        J = pin.getFrameJacobian(*local).reshape(6, -1)[rows]
        U, sigma, Vt = thin_svd(J)
        largest, smallest = sigma[0], sigma[-1]
        if largest <= self.slow * smallest or smallest <= self.rank_tolerance:
            return 1.0
        rate = pin.getFrameJacobianTimeVariation(*local).reshape(6, -1)[rows]
        growth, fall = (U[:, i].dot(rate).dot(Vt[i]) for i in (0, -1))
        if growth * smallest <= largest * fall:
            return 1.0
        return max(0.0, (self.stop - float(largest / smallest)) / (self.stop - self.slow))
