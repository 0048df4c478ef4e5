"""Two tasks that cannot both be done: the hand's and the elbow's."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from math import pi
from types import MappingProxyType
from typing import Annotated, Literal

import numpy as np
import pinocchio as pin

from dikbench.problem import (
    Array,
    Drawn,
    Kinematics,
    PoseTask,
    PositionTask,
    Range,
    Robot,
    TrackingTask,
    damped_least_squares,
    null_space,
)
from dikbench.scenario import (
    Case,
    Claim,
    Gain,
    NamedRobotFamily,
    Perturbation,
    Variation,
    joint_oracle,
    joint_path,
    samples,
    there_and_back,
    usual_claims,
)


@dataclass(frozen=True)
class Conflict:
    """The motion and the second task of a robot.

    Attributes:
        start: posture at the beginning and the end of the motion, (nv,) [rad].
        middle: posture half way, where the second task loses rank in the null space of the first.
        elbow: the frame of the second task.
        offset: from the elbow at the start to its target [m].
        whole_pose: whether the first task is a pose or a position.
    """

    start: tuple[float, ...]
    middle: tuple[float, ...]
    elbow: str
    offset: tuple[float, float, float]
    whole_pose: bool


CONFLICTS: Mapping[str, Conflict] = MappingProxyType(
    {
        # Elbow and hand are on one line half way, the elbow's target farther back.
        "planar4r": Conflict(
            (0.5, 0.6, 0.4, 1.0), (0.3, 0.6, 0.4, 0.0), "link2", (-0.065, -0.135, 0), False
        ),
        # Four rows for three joints: the elbow never moves independently.
        "planar3r": Conflict((0.4, 0.8, 0.9), (0.4, 0.8, 0.0), "link2", (0.1, -0.1, 0), False),
        # The elbow's target is out of its reach from the shoulder.
        "panda": Conflict(
            (0, -pi / 4, 0, -3 * pi / 4, 0, pi / 2, pi / 4),
            (0.2, -pi / 4, 0, -3 * pi / 4 + 0.2, 0, pi / 2, pi / 4),
            "panda_link4",
            (-0.2, 0.1, 0.15),
            True,
        ),
    }
)

SELF_MOTION_STEPS = 50
"""Steps of the elbow towards its target while the hand rests."""


@dataclass(frozen=True, kw_only=True)
class TaskConflict(NamedRobotFamily):
    """A moving hand and an elbow with a target elsewhere, which tests priorities.

    The joints move as q(t) = q_a + (q_b - q_a) sin^2(pi t/T) and the hand follows with its position
    (planar arms) or its pose (Panda); the elbow, of second priority, has a fixed target. Half way
    the second task has less rank in the null space of the first than by itself,
    rank(J_2 N_1) < rank J_2: on planar4r elbow and hand are then on one line, on planar3r and the
    Panda there are always too few joints. A seed moves the start by up to 0.05 rad and
    changes the duration by up to 10 %.

    Provokes: algorithmic singularities, and second tasks that leak into the first

    Shows in: position_error_max_m, second_task_error_rms, velocity_peak_ratio

    Attributes:
        robot: one of these robots.
        speed: peak joint speed of the exact motion over the limits.
        second_gain: gain of the elbow's task.

    Source: Chiaverini 1997 (algorithmic singularities).
    """

    robot: Literal["planar4r", "planar3r", "panda"] = "planar4r"
    speed: Annotated[float, Range(0.05, 0.9), Drawn(0.1, 0.7)] = 0.3
    second_gain: Gain = 2.0

    variation = Variation(start=0.05, timing=0.1)
    outruns_sampling = True

    def case(self, robot: Robot, change: Perturbation) -> Case:
        """See `Family`."""
        where = CONFLICTS[self.robot]
        start = change.posture(robot, np.array(where.start))
        offset = np.array(where.middle) - start
        assert robot.limits.velocity is not None
        # The rate of sin^2(pi t/T) peaks at pi/T.
        fastest = float((np.abs(offset) / robot.limits.velocity.upper).max())
        duration = pi * fastest / self.speed * change.pace
        q_r, v_r = there_and_back(robot, start, offset, duration)
        task = PoseTask if where.whole_pose else PositionTask
        tracking: TrackingTask = task(gain=self.gain)
        kinematics = Kinematics(robot)
        kinematics.update(start)
        elbow = kinematics.placement(robot.model.getFrameId(where.elbow)).translation
        target = elbow + np.array(where.offset)
        second = PositionTask(target=target, gain=self.second_gain, frame=where.elbow, priority=2)
        motion = joint_oracle(robot, q_r, samples(duration, self.dt), tracking)
        free, alone, apart = _conflict(robot, motion.q[len(motion.q) // 2], tracking, second)
        speed = (0.8 * self.speed, 1.2 * self.speed)
        claims = (
            Claim("smallest singular value of J_2 N_1 half way (m)", free, at_most=1e-3),
            Claim("smallest singular value of J_2 itself (m)", alone, at_least=0.01),
            Claim("least error of the elbow, the hand on its way [m]", apart, at_least=0.02),
            Claim("smallest singular value of the hand's task", motion.sigma_min.min(), 0.02),
            *usual_claims(motion, margin=0.05),
            *usual_claims(motion, speed=speed),
        )
        return Case(
            joint_path(robot, q_r, v_r, duration),
            start,
            motion,
            claims,
            tracking=tracking,
            v0=v_r(0.0),
            tasks=(second,),
        )


def _conflict(
    arm: Robot, q: Array, tracking: TrackingTask, second: PositionTask
) -> tuple[float, float, float]:
    """Compute sigma_min of J_2 N_1 and of J_2 at q, and the elbow's least error [m].

    The error is the least one that the arm reaches from q while the hand rests.
    """
    kinematics = Kinematics(arm)
    kinematics.update(q)
    hand = kinematics.placement(arm.frame_id).copy()
    first = tracking.linearize(kinematics, hand)
    task = second.linearize(kinematics)
    singular = np.linalg.svd(task.J, compute_uv=False)
    rank = int(np.count_nonzero(singular > 1e-3))
    left = np.linalg.svd(task.J @ null_space(first.J, 1e-6), compute_uv=False)
    free = float(left[rank - 1]) if len(left) >= rank else 0.0
    apart = float(np.linalg.norm(task.error))
    for _ in range(SELF_MOTION_STEPS):
        back = np.linalg.pinv(first.J, rcond=1e-6) @ first.error
        N = null_space(first.J, 1e-6)
        pull = task.error - task.J @ back
        q = pin.integrate(arm.model, q, back + N @ damped_least_squares(task.J @ N, pull, 0.05))
        kinematics.update(q)
        first, task = tracking.linearize(kinematics, hand), second.linearize(kinematics)
        apart = min(apart, float(np.linalg.norm(task.error)))
    return free, float(singular[rank - 1]), apart
