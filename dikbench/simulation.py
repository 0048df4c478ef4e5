"""The closed loop: a scenario, a law, a solver, a plant -> a trace."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Literal

import numpy as np
import pinocchio as pin

from dikbench.array import Array
from dikbench.control_step import TrialEnded, control_step
from dikbench.kinematics import Kinematics
from dikbench.plants import Plant
from dikbench.problem import DikProblem, Formulation
from dikbench.progress import STUCK_PROGRESS, progress, row_weights
from dikbench.scenario import Scenario
from dikbench.solvers.checked import CheckedSolve
from dikbench.status import STEP_CODE, Status
from dikbench.tasks import PoseTask
from dikbench.trace import Trace

ReferenceMode = Literal["time", "path"]

LONGEST = 5
"""A path-indexed run ends at the path's end, or after this many times its nominal duration."""

FASTEST = 1e6
"""A commanded speed above this [rad/s] means that the run has diverged."""

FARTHEST = 100.0
"""A task error above this (m, rad) means that the run has diverged."""

ROUNDING = 1e-9
"""A path is at its end when this share of it is left."""


@dataclass(frozen=True, eq=False)
class Run:
    """A finished simulation.

    Attributes:
        trace: what happened, up to the end.
        status: `ok` if the run came to its end, else what ended it.
        message: the reason, with the step at which it happened; empty for `ok`.
    """

    trace: Trace
    status: Status
    message: str


class _Recorder:
    """Preallocated arrays that become a trace."""

    def __init__(self, scenario: Scenario, steps: int) -> None:
        n, nv, m = steps, scenario.robot.nv, len(scenario.robot.task_rows)
        self.q = np.empty((n + 1, scenario.robot.nq))
        self.tau = np.empty(n + 1)
        self.wanted = np.empty((n, m))
        self.task_jacobian = np.empty((n, m, nv))
        self.commanded = np.empty((n, nv))
        self.applied = np.empty((n, nv))
        self.status = np.zeros(n, dtype=int)
        self.relaxed = np.zeros(n, dtype=int)
        self.residuals = np.zeros((n, 4))

    def trace(self, scenario: Scenario, n: int) -> Trace:
        """The trace of the first n steps; steps that went nowhere become `stuck`."""
        achieved = np.einsum("kij,kj->ki", self.task_jacobian[:n], self.commanded[:n])
        alpha = progress(self.wanted[:n], achieved, row_weights(scenario.robot.task_rows))
        status = self.status[:n].copy()
        status[(status == STEP_CODE[Status.OK]) & (alpha < STUCK_PROGRESS)] = STEP_CODE[
            Status.STUCK
        ]
        primal, dual, gap, distance = self.residuals[:n].T
        return Trace(
            scenario.dt,
            self.q[: n + 1],
            self.tau[: n + 1],
            self.wanted[:n],
            self.commanded[:n],
            self.applied[:n],
            status,
            self.relaxed[:n],
            primal.copy(),
            dual.copy(),
            gap.copy(),
            distance.copy(),
        )


def simulate(
    scenario: Scenario,
    formulation: Formulation,
    solve: CheckedSolve,
    plant: Plant,
    mode: ReferenceMode = "time",
) -> Run:
    """Run a law in closed loop over a scenario.

    Args:
        scenario: the case.
        formulation: the law.
        solve: its solver.
        plant: what becomes of a commanded velocity.
        mode: whether the reference moves on with the clock or with the progress achieved.

    Returns:
        The trace and how the run ended; failures of the law are statuses, never exceptions.
    """
    robot, dt, reference = scenario.robot, scenario.dt, scenario.reference
    model, rows = robot.model, row_weights(robot.task_rows)
    steps = scenario.steps * (LONGEST if mode == "path" else 1)
    targets = _time_indexed(scenario) if mode == "time" else None
    record = _Recorder(scenario, steps)
    kinematics, tracking = Kinematics(robot), PoseTask(gain=scenario.gain)
    q, v_prev, tau, k = scenario.q0, scenario.v0, 0.0, 0
    status, message = Status.OK, ""
    try:
        for k in range(steps):
            if targets is not None:
                tau = k * dt
                target, twist = targets[k]
            elif tau >= reference.duration * (1 - ROUNDING):
                break
            else:
                target, twist = reference.placement(tau), reference.velocity(tau)
            kinematics.update(q)
            task = tracking.linearize(kinematics, target, twist)
            tasks = [task, *[secondary.linearize(kinematics) for secondary in scenario.tasks]]
            limits = robot.limits.at(q)
            record.q[k], record.tau[k], record.wanted[k] = q, tau, task.V
            record.task_jacobian[k] = task.J
            if task.error @ task.error > FARTHEST**2:
                raise TrialEnded(Status.DIVERGED, f"task error above {FARTHEST:g} m, rad")
            problem = DikProblem(robot, q, v_prev, dt, tasks, limits)
            outcome = control_step(formulation, problem, solve)
            v = outcome.velocity
            if np.abs(v).max() > FASTEST:
                raise TrialEnded(Status.DIVERGED, f"commanded speed above {FASTEST:g} rad/s")
            applied = plant(v, limits, dt)
            record.commanded[k], record.applied[k] = v, applied
            record.status[k] = STEP_CODE[outcome.status]
            record.relaxed[k] = problem.relaxed
            record.residuals[k] = solve.primal, solve.dual, solve.gap, solve.distance
            if targets is None:
                alpha = progress(task.V[None], (task.J @ applied)[None], rows)[0]
                tau += dt * (1.0 if np.isnan(alpha) else min(max(float(alpha), 0.0), 1.0))
                tau = min(tau, reference.duration)
            q = pin.integrate(model, q, applied * dt)
            v_prev = applied
        else:
            k = steps
    except TrialEnded as ended:
        status, message = ended.status, f"step {k}: {ended}"
    record.q[k], record.tau[k] = q, tau if targets is None else k * dt
    return Run(record.trace(scenario, k), status, message)


def _time_indexed(scenario: Scenario) -> list[tuple[Any, Array]]:
    """Placement and body twist of the reference at every control step."""
    reference, dt = scenario.reference, scenario.dt
    return [
        (reference.placement(k * dt), reference.velocity(k * dt)) for k in range(scenario.steps)
    ]
