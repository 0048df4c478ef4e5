"""A motion of the planar arm made by hand, of which a pocket calculator gives every metric."""

from __future__ import annotations

import math

import numpy as np
import pinocchio as pin

from dikbench.metrics import evaluate, motion_of
from dikbench.problem.tasks import PoseTask, PositionTask
from dikbench.robots.loading import load_robot
from dikbench.scenario import Scenario
from dikbench.scenario.certificate import Certificate
from dikbench.scenario.reference.reference import target_at_rest
from dikbench.simulation.status import STEP_CODE, Status
from dikbench.simulation.trace import Trace

# The planar arm at q = (q_1, 90 deg, 0): its tip is at (0.4, 0.5), 0.41^(1/2) m from the base,
# turned by q_1 and pointing 90 deg to the left. A speed w of joint 1 moves it, in its own axes,
# with (0.4, 0.5, 1) w; the body Jacobian depends on q_2 and q_3 only.

J = np.array([[0.4, 0.0, 0.0], [0.5, 0.5, 0.2], [1.0, 1.0, 1.0]])
STEP = J[:, 0]
RADIUS = math.sqrt(0.41)
ELBOW = 0.4 / RADIUS  # the end of the first link, at 0.4 m, is the second task's


def tip_scenario() -> Scenario:
    """Hold tip and elbow where they are at q_1 = 0; limits of 0.05 rad, 1.5 rad/s, 20 rad/s^2."""
    robot = load_robot("planar3r").with_limits(
        position=([-0.25, -2, -2], [0.05, 2, 2]), velocity=(-1.5, 4.0), acceleration=20.0
    )
    target = pin.SE3(pin.utils.rotate("z", np.pi / 2), np.array([0.4, 0.5, 0.0]))
    return Scenario(
        robot=robot,
        q0=np.array([0.0, np.pi / 2, 0.0]),
        v0=np.array([0.5, 0.0, 0.0]),
        reference=target_at_rest(target, 0.4),
        tracking=PoseTask(gain=1.0),
        dt=0.1,
        duration=0.4,
        certificate=Certificate(()),
        tasks=(PositionTask(target=np.array([0.4, 0.0, 0.0]), frame="link1", priority=2),),
    )


def trace_of(speeds: list[float], wanted: list[list[float]], statuses: list[Status]) -> Trace:
    """Move joint 1 at the given speeds from q_1 = 0 on, for 0.1 s each."""
    n = len(speeds)
    q = np.zeros((n + 1, 3))
    q[:, 0] = np.concatenate([[0.0], np.cumsum(speeds)]) * 0.1
    q[:, 1] = np.pi / 2
    applied = np.zeros((n, 3))
    applied[:, 0] = speeds
    return Trace(
        dt=0.1,
        q=q,
        tau=0.1 * np.arange(n + 1.0),
        wanted=np.array(wanted).reshape(n, 3),
        commanded=applied + 100.0,  # nothing may be read off the command
        applied=applied,
        status=np.array([STEP_CODE[s] for s in statuses], dtype=int),
        relaxed=np.array([0, 2, 0, 1][:n], dtype=int),
        claimed=np.array([1, 0, 1, -1][:n], dtype=int),
        verified=np.array([1, 0, 0, -1][:n], dtype=int),
        # Of the last step, at which nothing was solved, no residual counts.
        primal=np.array([1e-9, 3e-3, 2e-3, 9.0][:n], dtype=float),
        dual=np.array([np.nan, 1e-3, 2e-3, 9.0][:n], dtype=float),
        gap=np.array([0.0, 4e-5, 1e-5, 9.0][:n], dtype=float),
        distance=np.array([0.0, 0.25, 0.125, np.nan][:n]),
    )


def four_steps() -> dict[str, float]:
    """Evaluate q_1 = 0, 0.1, -0.1, -0.2, -0.2: forward, back too fast, back, stopped."""
    trace = trace_of(
        speeds=[1.0, -2.0, -1.0, 0.0],
        wanted=[
            [0.4, 0.5, 1.0],  # done as wanted
            [0.4, 0.5, 1.0],  # twice as fast, in reverse
            [-0.8, -1.0, -2.0],  # half of it
            [0.4, 0.5, 1.0],  # nothing of it
        ],
        statuses=[Status.OK, Status.SOLVER_FAILED, Status.NOT_VERIFIED, Status.INFEASIBLE],
    )
    return evaluate(motion_of(trace, tip_scenario()))
