"""The witness of a scenario, slowed down so that it keeps all limits, as a formulation."""

from __future__ import annotations

from typing import Final

import numpy as np
import pinocchio as pin

from dikbench.arrays import Array
from dikbench.problem.problem import DikProblem, Solve
from dikbench.scenario.scenario import Scenario

SPEED_SHARE: Final = 1 - 1e-6
"""Share of the velocity limits that is used."""

PACE_STEPS: Final = 20
"""Attempts at a pace before the motion waits for one control period."""


class SlowedOracle:
    """Commands the witness of a scenario at the largest pace that keeps all limits, for one run.

        v = (q(tau + s dt) - q(tau)) / dt,   tau <- tau + s dt,   s <= 1 as large as possible

    within the velocity limits, and at most the pace that the torques allow. It looks ahead along a
    motion that is known from the start, as no formulation can, and measures nothing.

    Args:
        scenario: a scenario that has a witness.
    """

    def __init__(self, scenario: Scenario) -> None:
        witness = scenario.witness
        assert witness is not None
        self._scenario, self._motion = scenario, witness.motion
        self._end = float(witness.motion.instants[-1])
        self._tau, self._q = 0.0, scenario.q0
        self._torque_pace = float(witness.paces.min()) if scenario.limits_torques else 1.0

    def velocity(self, problem: DikProblem, solve: Solve) -> Array:
        """Command the next velocity (see `Formulation`)."""
        dt, model = problem.dt, problem.robot.model
        limit = problem.robot.limits.velocity
        pace = self._torque_pace
        for _ in range(PACE_STEPS):
            tau = min(self._tau + pace * dt, self._end)
            q = self._scenario.along(self._motion, tau)
            v: Array = pin.difference(model, self._q, q) / dt
            usage = 0.0 if limit is None else float(limit.usage(v).max())
            if usage <= SPEED_SHARE * (1 + 1e-9):
                self._tau, self._q = tau, q
                return v
            pace *= SPEED_SHARE / usage
        return np.zeros(problem.robot.nv)
