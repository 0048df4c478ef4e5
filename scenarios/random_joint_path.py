"""A smooth random motion of all joints through their whole ranges; the task frame follows it."""

from __future__ import annotations

from dataclasses import dataclass
from math import pi
from typing import Annotated

import numpy as np
import pinocchio as pin
from scipy.interpolate import BSpline

from dikbench.problem import Array, Drawn, Range, Robot
from dikbench.scenario import (
    Case,
    Family,
    Perturbation,
    Variation,
    check_velocity_limits,
    joint_oracle,
    joint_path,
    samples,
    usual_claims,
)

MARGIN_RAD = 0.1
"""Distance that the motion keeps from position limits."""

DEGREE = 3


@dataclass(frozen=True, kw_only=True)
class RandomJointPath(Family):
    """A random task: the task frame of a smooth random joint motion through the whole limits.

    The joints move as a clamped cubic B-spline of random control points, uniform in the position
    limits less 0.1 rad (an unlimited joint: half a turn to either side of the start), the first two
    equal and the last two, so that it starts and ends at rest. It stays in the hull of its points,
    hence inside the limits, and may pass singularities and the arm's own body. The velocity of the
    task frame is exactly J(q) dq/dt. The duration is such that the joint speeds peak at `speed`
    times their limits. A seed moves the whole path by up to 0.1 rad in each joint, not past the
    margin, and changes the duration by up to 10 %.

    Provokes: nothing on purpose, so that what happens on average is seen

    Shows in: position_error_max_m, velocity_peak_ratio, slow_down

    Attributes:
        number: of the random path; another number is another one.
        points: number of distinct control points.
        speed: peak of the joint speeds over their limits; above 1 the path must wait.

    Source: by construction; B-splines: de Boor 1978.
    """

    number: Annotated[int, Range(0, 99999), Drawn(0, 99999)] = 0
    points: Annotated[int, Range(3, 20), Drawn(3, 6)] = 4
    speed: Annotated[float, Range(0.05, 3.0), Drawn(0.2, 1.5, log=True)] = 0.5

    robots = ("panda", "ur3", "ur5", "ur10", "xarm7", "kinova", "tiago", "talos", "lwr")
    variation = Variation(start=0.1, timing=0.1)
    outruns_sampling = True

    def case(self, robot: Robot, change: Perturbation) -> Case:
        """See `Family`."""
        check_velocity_limits(robot, "the duration")
        spline = self._spline(robot, change)
        rate, speed = spline.derivative(), self.speed / change.pace
        assert robot.limits.velocity is not None
        peak = float(robot.limits.velocity.usage(rate(np.linspace(0.0, 1.0, 1001))).max())
        duration = peak / speed

        def q_r(tau: float) -> Array:
            q: Array = pin.integrate(robot.model, robot.q0, spline(min(tau / duration, 1.0)))
            return q

        def v_r(tau: float) -> Array:
            v: Array = rate(min(tau / duration, 1.0)) / duration
            return v

        motion = joint_oracle(robot, q_r, samples(duration, self.dt, most=1000))
        claims = usual_claims(motion, speed=(0.95 * speed, 1.01 * speed), margin=0.99 * MARGIN_RAD)
        reference = joint_path(robot, q_r, v_r, duration)
        return Case(reference, motion.q[0], motion, claims, v0=v_r(0.0))

    def _spline(self, robot: Robot, change: Perturbation) -> BSpline:
        """Draw the joints' displacements (nv,) from the robot's start, over [0, 1]."""
        lower, upper = np.full((2, robot.nv), np.inf) * [[-1], [1]]
        if robot.limits.position is not None:
            start = robot.q0[robot.limits.q_index]
            lower, upper = robot.limits.position.lower - start, robot.limits.position.upper - start
        limited = np.isfinite(lower) & np.isfinite(upper)
        margin = MARGIN_RAD * robot.joint_scale
        lower = np.where(limited, lower + margin, -pi)
        upper = np.where(limited, upper - margin, pi)
        narrow = lower > upper  # a joint with less than two margins of room stays in its middle
        lower[narrow] = upper[narrow] = (0.5 * (lower + upper))[narrow]
        drawn = np.random.default_rng(self.number).uniform(lower, upper, (self.points, robot.nv))
        drawn[:, np.setdiff1d(np.arange(robot.nv), robot.chain)] = 0.0
        moved = pin.difference(robot.model, robot.q0, change.posture(robot, robot.q0))
        drawn = np.clip(drawn + moved, lower, upper)
        control = np.vstack([drawn[:1], drawn, drawn[-1:]])
        inner = np.linspace(0.0, 1.0, len(control) - DEGREE + 1)
        return BSpline(np.pad(inner, DEGREE, mode="edge"), control, DEGREE)
