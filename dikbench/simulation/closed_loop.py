"""The closed loop: a scenario, a formulation, a solver, a plant -> a trace."""

from __future__ import annotations

from dataclasses import dataclass
from time import perf_counter_ns
from typing import Final

import msgspec
import numpy as np
import pinocchio as pin

from dikbench.arrays import Array, read_only
from dikbench.problem.posing import pose_problem
from dikbench.problem.problem import Formulation
from dikbench.problem.progress import STUCK_PROGRESS, progress, row_weights
from dikbench.robots.kinematics import Kinematics
from dikbench.scenario.plant import Plant
from dikbench.scenario.scenario import Scenario
from dikbench.simulation.clock import CLOCKS, ReferenceMode
from dikbench.simulation.control_step import TrialEnded, control_step
from dikbench.simulation.status import STEP_CODE, STEP_STATUSES, Status
from dikbench.simulation.trace import Trace
from dikbench.solvers.checked_solve import CheckedSolve
from dikbench.solvers.recheck.rechecked import RecheckedSteps

DIVERGED_SPEED: Final = 1e6
"""A commanded speed above this [rad/s] means that the run has diverged."""

DIVERGED_ERROR: Final = 100.0
"""A task error above this (m, rad) means that the run has diverged."""

ERROR_CHECK_PERIOD: Final = 16
"""The task error is checked once in this many control steps."""


@dataclass(frozen=True, eq=False)
class Run:
    """A finished simulation.

    Attributes:
        trace: what happened, up to the end.
        status: `ok` if the run came to its end, else what ended it.
        message: the reason, with the step at which it happened; empty for `ok`.
        kinematics_ns: time in kinematics and in posing the problems, over all steps [ns].
        formulation_ns: time in the formulation, its solver included [ns].
        jacobians: Jacobians of the tracking task at every step, (n, m, nv), as the formulation saw
            them.
    """

    trace: Trace
    status: Status
    message: str
    kinematics_ns: int
    formulation_ns: int
    jacobians: Array


class _Step(msgspec.Struct, eq=False):
    """The record of a control step that was applied; its arrays are read-only (see `Trace`)."""

    q: Array
    tau: float
    wanted: Array
    jacobian: Array
    commanded: Array
    applied: Array
    status: Status
    relaxed: int


def simulate(
    scenario: Scenario,
    formulation: Formulation,
    solve: CheckedSolve,
    plant: Plant,
    mode: ReferenceMode = "time",
    seed: int = 0,
) -> Run:
    """Run a formulation in closed loop over a scenario.

    Args:
        scenario: the case.
        formulation: the law under test.
        solve: its solver.
        plant: what the formulation sees of the robot, and what becomes of a commanded velocity.
        mode: whether the reference moves on with the clock or waits for the robot.
        seed: of the plant's noise.

    Returns:
        The trace and how the run ended; failures of the formulation are statuses, never exceptions.
    """
    robot, dt, tracking = scenario.robot, scenario.dt, scenario.tracking
    kinematics, clock, started = (
        Kinematics(robot),
        CLOCKS[mode](scenario),
        plant.start(scenario, seed),
    )
    q, v_prev = read_only(scenario.q0.copy()), read_only(scenario.v0.copy())
    steps: list[_Step] = []
    kinematics_ns = formulation_ns = 0
    status, message = Status.OK, ""
    solve.begin_run(clock.most_steps)
    try:
        while not clock.is_over:
            k, (target, twist), seen = len(steps), clock.target(), started.seen(q)
            start = perf_counter_ns()
            kinematics.update(seen)
            task = tracking.linearize(kinematics, target, twist)
            problem = pose_problem(
                kinematics, v_prev, dt, task, scenario.tasks, scenario.constraints
            )
            for each in problem.tasks:
                each.J.flags.writeable = each.V.flags.writeable = False
            kinematics_ns += perf_counter_ns() - start
            # What the formulation does to the problem reaches neither the record nor the plant.
            wanted, jacobian = task.V, task.J
            limits = problem.limits if seen is q else robot.limits.at(q)
            if k % ERROR_CHECK_PERIOD == 0 and task.error.dot(task.error) > DIVERGED_ERROR**2:
                raise TrialEnded(Status.DIVERGED, f"task error above {DIVERGED_ERROR:g} m, rad")
            answer = control_step(formulation, problem, solve, k)
            formulation_ns += answer.formulation_ns
            if answer.square > DIVERGED_SPEED**2:
                raise TrialEnded(Status.DIVERGED, f"commanded speed above {DIVERGED_SPEED:g} rad/s")
            v = read_only(answer.velocity)
            applied = started.apply(v, limits)
            steps.append(
                _Step(q, clock.tau, wanted, jacobian, v, applied, answer.status, problem.relaxed)
            )
            q, v_prev = read_only(pin.integrate(robot.model, q, applied * dt)), applied
            clock.advance(q)
    except TrialEnded as ended:
        status, message = ended.status, f"step {len(steps)}: {ended}"
    jacobians = _joined([step.jacobian for step in steps], len(scenario.rows), robot.nv)
    trace = _trace(scenario, steps, q, clock.tau, jacobians, solve.rechecked(), mode)
    return Run(trace, status, message, kinematics_ns, formulation_ns, jacobians)


def _trace(
    scenario: Scenario,
    steps: list[_Step],
    q: Array,
    tau: float,
    jacobians: Array,
    rechecked: RecheckedSteps,
    mode: ReferenceMode,
) -> Trace:
    """Make the trace of steps that ended in q at tau; those that went nowhere become `stuck`."""
    n, nv, m = len(steps), scenario.robot.nv, len(scenario.rows)
    wanted = _joined([step.wanted for step in steps], m)
    commanded = _joined([step.commanded for step in steps], nv)
    achieved = np.einsum("kij,kj->ki", jacobians, commanded)
    alpha = progress(wanted, achieved, row_weights(scenario.rows))
    status = np.array([STEP_STATUSES.index(step.status) for step in steps], dtype=int)
    ok = STEP_CODE[Status.OK]
    status[(status == ok) & rechecked.lied[:n]] = STEP_CODE[Status.NOT_VERIFIED]
    status[(status == ok) & (alpha < STUCK_PROGRESS)] = STEP_CODE[Status.STUCK]
    return Trace(
        scenario.dt,
        _joined([*(step.q for step in steps), q], scenario.robot.nq),
        np.array([*(step.tau for step in steps), tau]),
        wanted,
        commanded,
        _joined([step.applied for step in steps], nv),
        status,
        np.array([step.relaxed for step in steps], dtype=int),
        rechecked.claimed[:n],
        rechecked.verified[:n],
        rechecked.primal[:n],
        rechecked.dual[:n],
        rechecked.gap[:n],
        rechecked.distance[:n],
        mode,
    )


def _joined(parts: list[Array], *shape: int) -> Array:
    """Join arrays of one shape into one, (len(parts), *shape)."""
    return np.concatenate(parts or [np.empty((0, *shape))]).reshape(len(parts), *shape)
