"""The closed loop: a scenario, a law, a solver, a plant -> a trace."""

from __future__ import annotations

from collections import deque
from dataclasses import dataclass
from time import perf_counter_ns
from typing import Any, Literal

import numpy as np
import pinocchio as pin

from dikbench.arrays import Array
from dikbench.problem.constraints import linearize_all
from dikbench.problem.problem import DikProblem, Formulation
from dikbench.problem.progress import STUCK_PROGRESS, progress, row_weights
from dikbench.robots.kinematics import Kinematics
from dikbench.scenario.plant import Plant
from dikbench.scenario.scenario import Scenario
from dikbench.simulation.control_step import TrialEnded, control_step
from dikbench.simulation.status import STEP_CODE, Status
from dikbench.simulation.trace import Trace
from dikbench.solvers.checked_solve import CheckedSolve
from dikbench.solvers.recheck.rechecked import Verdicts

ReferenceMode = Literal["time", "path"]

LONGEST = 5
"""A path-indexed run ends at the path's end, or after this many times its nominal duration."""

FASTEST = 1e6
"""A commanded speed above this [rad/s] means that the run has diverged."""

FARTHEST = 100.0
"""A task error above this (m, rad) means that the run has diverged."""

FAR_CHECK = 16
"""The task error is looked at every so many steps."""

NOISE_STREAM = 3
"""Keeps the noise apart from what the same seed draws of the scenario."""

ROUNDING = 1e-9
"""A path is at its end when this share of it is left."""


@dataclass(frozen=True, eq=False)
class Run:
    """A finished simulation.

    Attributes:
        trace: what happened, up to the end.
        status: `ok` if the run came to its end, else what ended it.
        message: the reason, with the step at which it happened; empty for `ok`.
        kinematics_ns: time in kinematics and in setting up the problems, over all steps [ns].
        law_ns: time in the law, its solver included [ns].
        jacobians: task Jacobians of the control steps, (n, m, nv), as the law saw them.
    """

    trace: Trace
    status: Status
    message: str
    kinematics_ns: int
    law_ns: int
    jacobians: Array


class _Recorder:
    """Lists that become the arrays of a trace; what is appended must not change any more."""

    def __init__(self, steps: int) -> None:
        self.q: list[Array] = []
        self.wanted: list[Array] = []
        self.task_jacobian: list[Array] = []
        self.commanded: list[Array] = []
        self.applied: list[Array] = []
        self.status = np.full(steps, STEP_CODE[Status.OK])
        self.relaxed = np.zeros(steps, dtype=int)

    def jacobians(self, scenario: Scenario) -> Array:
        """The task Jacobians of the steps that were applied, (n, m, nv)."""
        m, nv = len(scenario.rows), scenario.robot.nv
        return _joined(self.task_jacobian[: len(self.applied)], m, nv)

    def trace(self, scenario: Scenario, tau: Array, verdicts: Verdicts, jacobians: Array) -> Trace:
        """The trace of the steps that were applied; those that went nowhere become `stuck`."""
        n, nv, m = len(self.applied), scenario.robot.nv, len(scenario.rows)
        wanted = _joined(self.wanted[:n], m)
        commanded = _joined(self.commanded, nv)
        achieved = np.einsum("kij,kj->ki", jacobians, commanded)
        alpha = progress(wanted, achieved, row_weights(scenario.rows))
        status, ok = self.status[:n].copy(), STEP_CODE[Status.OK]
        status[(status == ok) & verdicts.lied[:n]] = STEP_CODE[Status.NOT_VERIFIED]
        status[(status == ok) & (alpha < STUCK_PROGRESS)] = STEP_CODE[Status.STUCK]
        return Trace(
            scenario.dt,
            _joined(self.q, scenario.robot.nq),
            tau[: n + 1],
            wanted,
            commanded,
            _joined(self.applied, nv),
            status,
            self.relaxed[:n],
            verdicts.claimed[:n],
            verdicts.verified[:n],
            verdicts.primal[:n],
            verdicts.dual[:n],
            verdicts.gap[:n],
            verdicts.distance[:n],
        )


def _joined(parts: list[Array], *shape: int) -> Array:
    """Arrays of one shape as one array, (len(parts), *shape)."""
    return np.concatenate(parts or [np.empty((0, *shape))]).reshape(len(parts), *shape)


def simulate(
    scenario: Scenario,
    formulation: Formulation,
    solve: CheckedSolve,
    plant: Plant,
    mode: ReferenceMode = "time",
    seed: int = 0,
) -> Run:
    """Run a law in closed loop over a scenario.

    Args:
        scenario: the case.
        formulation: the law.
        solve: its solver.
        plant: what the law sees of the robot, and what becomes of a commanded velocity.
        mode: whether the reference moves on with the clock or with the progress achieved.
        seed: of the plant's noise.

    Returns:
        The trace and how the run ended; failures of the law are statuses, never exceptions.
    """
    robot, dt, secondaries = scenario.robot, scenario.dt, scenario.tasks
    constraints = scenario.constraints
    model, limits_at, integrate, ok = robot.model, robot.limits.at, pin.integrate, Status.OK
    steps = scenario.steps * (LONGEST if mode == "path" else 1)
    targets = scenario.targets if mode == "time" else None
    clock = _PathClock(scenario)
    record, tau = _Recorder(steps), dt * np.arange(steps + 1, dtype=float)
    kinematics, tracking, drive = Kinematics(robot), scenario.tracking, plant.drive
    noise = _Noise(plant.noise, seed, model) if plant.noise else None
    late = deque([scenario.v0] * plant.delay) if plant.delay else None
    q, v_prev, k = _read_only(scenario.q0.copy()), _read_only(scenario.v0.copy()), 0
    kinematics_ns = law_ns = 0
    status, message = ok, ""
    solve.begin_run(steps)
    record.q.append(q)
    try:
        for k in range(steps):
            if targets is not None:
                target, twist = targets[k]
            elif clock.is_over:
                break
            else:
                target, twist = scenario.target(clock.tau)
                tau[k] = clock.tau
            seen = q if noise is None else noise.on(q)
            start = perf_counter_ns()
            kinematics.update(seen)
            task = tracking.linearize(kinematics, target, twist)
            task.J.flags.writeable = task.V.flags.writeable = False
            tasks = [task]
            for secondary in secondaries:
                more = secondary.linearize(kinematics)
                more.J.flags.writeable = more.V.flags.writeable = False
                tasks.append(more)
            limits = limits_at(seen)
            problem = DikProblem(robot, seen, v_prev, dt, tasks, limits)
            if constraints:
                problem.G, problem.h = linearize_all(constraints, kinematics, v_prev, dt)
            kinematics_ns += perf_counter_ns() - start
            record.wanted.append(task.V)
            record.task_jacobian.append(task.J)
            if k % FAR_CHECK == 0 and task.error.dot(task.error) > FARTHEST**2:
                raise TrialEnded(Status.DIVERGED, f"task error above {FARTHEST:g} m, rad")
            outcome = control_step(formulation, problem, solve, k)
            law_ns += outcome.law_ns
            v = outcome.velocity
            if outcome.square > FASTEST**2:
                raise TrialEnded(Status.DIVERGED, f"commanded speed above {FASTEST:g} rad/s")
            v.flags.writeable = False  # it is recorded as it is
            arrived = v
            if late is not None:
                late.append(v)
                arrived = late.popleft()
            applied = drive(arrived, limits if noise is None else limits_at(q), dt)
            if applied is not arrived:
                applied.flags.writeable = False
            if outcome.status is not ok:
                record.status[k] = STEP_CODE[outcome.status]
            if problem.relaxed:
                record.relaxed[k] = problem.relaxed
            if targets is None:
                clock.advance(task.V, task.J @ applied)
            q = integrate(model, q, applied * dt)
            q.flags.writeable = False
            record.commanded.append(v)
            record.applied.append(applied)
            record.q.append(q)
            v_prev = applied
    except TrialEnded as ended:
        status, message = ended.status, f"step {k}: {ended}"
    if targets is None:
        tau[len(record.applied)] = clock.tau
    jacobians = record.jacobians(scenario)
    trace = record.trace(scenario, tau, solve.verdicts(), jacobians)
    return Run(trace, status, message, kinematics_ns, law_ns, jacobians)


def _read_only(array: Array) -> Array:
    array.flags.writeable = False
    return array


class _Noise:
    """What a measurement adds to the configuration: white and normal, of its own seed."""

    def __init__(self, deviation: float, seed: int, model: Any) -> None:
        self._deviation, self._model = deviation, model
        self._random = np.random.default_rng([seed, NOISE_STREAM])

    def on(self, q: Array) -> Array:
        """The configuration (nq,) as it is seen."""
        step = self._random.normal(0.0, self._deviation, self._model.nv)
        return _read_only(pin.integrate(self._model, q, step))


class _PathClock:
    """The nominal time of a path-indexed run, which moves on with the progress achieved."""

    def __init__(self, scenario: Scenario) -> None:
        self.tau = 0.0
        self._duration = scenario.reference.duration
        self._dt = scenario.dt
        self._weights = row_weights(scenario.rows)

    @property
    def is_over(self) -> bool:
        """Whether the path is at its end, but for rounding."""
        return self.tau >= self._duration * (1 - ROUNDING)

    def advance(self, wanted: Array, achieved: Array) -> None:
        """Move on by the share of the wanted motion that was made; a dwell passes in full."""
        alpha = float(progress(wanted[None], achieved[None], self._weights)[0])
        share = 1.0 if np.isnan(alpha) else min(max(alpha, 0.0), 1.0)
        self.tau = min(self.tau + self._dt * share, self._duration)
