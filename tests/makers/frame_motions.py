"""Motions of a frame made by hand along known curves, without a robot that makes them."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any, cast

import numpy as np
import pinocchio as pin

from dikbench.arrays import Array
from dikbench.metrics import Motion
from dikbench.problem.tasks import PoseTask
from dikbench.robots.loading import load_robot
from dikbench.scenario import Scenario
from dikbench.scenario.certificate import Certificate
from dikbench.scenario.reference.curves import circle, lemniscate
from dikbench.scenario.reference.reference import Reference
from dikbench.simulation.clock import ReferenceMode
from dikbench.simulation.trace import Trace

DT = 0.01
ROBOT = load_robot("panda")
PERIOD = 2.0
TOLERANCE = 5e-3
ROUND_TWICE = 0.4 * math.pi
SAMPLE_S = DT / 4
"""A path is sampled so often, and a lag is a multiple of it."""

Place = Callable[[float], Array]


def straight(duration: float = 2.0, speed: float = 0.3) -> Reference:
    """Move along x at a constant speed [m/s]."""
    return Reference(
        duration,
        lambda tau: pin.SE3(np.eye(3), np.array([speed * tau, 0.0, 0.0])),
        lambda tau: np.array([speed, 0, 0, 0, 0, 0]),
    )


def back_and_forth(duration: float = 4.0) -> Reference:
    """Move along x over 0.5 m and back on the same line, at 0.25 m/s."""
    return Reference(
        duration,
        lambda tau: pin.SE3(np.eye(3), np.array([0.5 - abs(0.5 - 0.25 * tau), 0.0, 0.0])),
        lambda tau: np.array([0.25, 0, 0, 0, 0, 0]),
    )


def with_dwell() -> Reference:
    """Move 0.3 m in a second, a second's rest, 0.3 m in another second, at constant speed."""

    def x(tau: float) -> float:
        return 0.3 * (min(tau, 1.0) + max(tau - 2.0, 0.0))

    return Reference(
        3.0,
        lambda tau: pin.SE3(np.eye(3), np.array([x(tau), 0.0, 0.0])),
        lambda tau: np.zeros(6),
    )


ROUND = circle(pin.SE3.Identity(), 0.1, PERIOD, 2.0)
EIGHT = lemniscate(pin.SE3.Identity(), 0.1, PERIOD, 2.0)


def of(
    reference: Reference, place: Place, tau: Array | None = None, tracking: Any = None
) -> Motion:
    """Make the motion of a frame that is at place(t) at the trace time t; 0.01 s per step."""
    n = round(reference.duration / DT)
    t = DT * np.arange(n + 1.0)
    mode: ReferenceMode = "time" if tau is None else "path"
    tau = t if tau is None else tau
    translations = np.array([place(time) for time in t])
    targets = np.array([reference.placement(each).translation for each in tau.tolist()])
    v, steps = np.zeros((n, 7)), np.zeros(n, dtype=int)
    rows = 6 if tracking is None else 3
    trace = Trace(
        DT, np.tile(ROBOT.q0, (n + 1, 1)), tau, np.zeros((n, rows)), v, v, steps, steps, steps - 1,
        steps - 1, np.zeros(n), np.zeros(n), np.zeros(n), np.zeros(n), mode,
    )  # fmt: skip
    scenario = Scenario(
        ROBOT, ROBOT.q0, v[0], reference, tracking or PoseTask(), DT, reference.duration,
        Certificate(()),
    )  # fmt: skip
    position = np.linalg.norm(translations - targets, axis=1)
    if tracking is not None:
        position = np.full(n + 1, np.nan)
    jacobians = np.tile(np.eye(rows, 7), (n + 1, 1, 1))
    turned = np.array([reference.placement(each).rotation for each in tau.tolist()])
    x, x_d = (scenario.embedding.points(turned, p) for p in (translations, targets))
    return Motion(trace, scenario, translations, position, np.zeros(n + 1), jacobians, x, x_d)


def on(reference: Reference, delay: float = 0.0, shift: Array | None = None) -> Place:
    """Be on the reference, so late [s] (resting at its start until then), and shifted [m]."""
    offset = np.zeros(3) if shift is None else shift
    return lambda t: cast(Array, reference.placement(max(t - delay, 0.0)).translation + offset)
