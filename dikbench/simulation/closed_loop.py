"""The closed loop: a scenario, a formulation, a solver, a plant -> a trace."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from time import perf_counter_ns
from typing import Final

import numpy as np
import pinocchio as pin

from dikbench.arrays import Array, Indices, read_only
from dikbench.problem.posing import pose_problem
from dikbench.problem.problem import Formulation
from dikbench.problem.progress import STUCK_PROGRESS, progress, row_weights
from dikbench.robots.kinematics import Kinematics
from dikbench.scenario.plant import Plant, ProtectiveStop, Step
from dikbench.scenario.scenario import Scenario
from dikbench.simulation.clock import CLOCKS, ReferenceMode
from dikbench.simulation.control_step import TrialEnded, control_step
from dikbench.simulation.status import STEP_CODE, STEP_STATUSES, Status
from dikbench.simulation.trace import Trace
from dikbench.solvers.checked_solve import CheckedSolve
from dikbench.solvers.recheck.rechecked import RecheckedSteps

DIVERGED_SPEED_RAD_S: Final = 1e6
"""Norm of a commanded velocity above which a run has diverged."""

DIVERGED_ERROR: Final = 100.0
"""Norm of a task error (m, rad) above which a run has diverged."""

ERROR_CHECK_PERIOD_STEPS: Final = 16
"""Control steps between checks of the task error."""


@dataclass(frozen=True, eq=False)
class Run:
    """A finished simulation.

    Attributes:
        trace: the record up to the end.
        status: `ok` if the run was completed, else the reason of its end.
        message: the reason in words, with the step; empty for `ok`.
        kinematics_ns: time in kinematics and in posing the problems, over all steps [ns].
        formulation_ns: time in the formulation, its solver included [ns].
        jacobians: Jacobians of the tracking task at every step, (n, m, nv), as the formulation
            had them.
    """

    trace: Trace
    status: Status
    message: str
    kinematics_ns: int
    formulation_ns: int
    jacobians: Array


_Step = tuple[Array, float, Array, Array, Array, Array, Status, int]
"""The record of a control step that was applied, its arrays read-only: q, tau, desired, jacobian,
commanded, applied, status, relaxed (see `Trace`)."""


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
        formulation: the formulation under test.
        solve: its solver.
        plant: the measurement and the drive.
        mode: whether the reference advances with the clock or waits for the robot.
        seed: seed of the plant's noise.

    Returns:
        The trace and how the run ended; failures of the formulation are statuses, never exceptions.
    """
    robot, model, dt = scenario.robot, scenario.robot.model, scenario.dt
    tracking, tasks, constraints = scenario.tracking, scenario.tasks, scenario.constraints
    kinematics, clock = Kinematics(robot), CLOCKS[mode](scenario)
    started, watches = plant.start(scenario, seed), type(plant).watch is not Plant.watch
    q, v_prev = read_only(scenario.q0.copy()), read_only(scenario.v0.copy())
    steps: list[_Step] = []
    kinematics_ns = formulation_ns = 0
    status, message = Status.OK, ""
    solve.begin_run(clock.most_steps)
    try:
        for target, twist in clock:
            k, seen = len(steps), started.seen(q)
            start = perf_counter_ns()
            kinematics.update(seen)
            task = tracking.linearize(kinematics, target, twist)
            problem = pose_problem(kinematics, v_prev, dt, task, tasks, constraints)
            for each in problem.tasks:
                each.J.setflags(write=False)
                each.V.setflags(write=False)
            kinematics_ns += perf_counter_ns() - start
            # The formulation may change the problem, but not the record or the plant's limits.
            desired, jacobian = task.V, task.J
            limits = problem.limits if seen is q else robot.limits.at(q)
            if k % ERROR_CHECK_PERIOD_STEPS == 0 and task.error.dot(task.error) > DIVERGED_ERROR**2:
                raise TrialEnded(Status.DIVERGED, f"task error above {DIVERGED_ERROR:g} m, rad")
            answer = control_step(formulation, problem, solve, k)
            formulation_ns += answer.formulation_ns
            if answer.square > DIVERGED_SPEED_RAD_S**2:
                raise TrialEnded(
                    Status.DIVERGED, f"commanded speed above {DIVERGED_SPEED_RAD_S:g} rad/s"
                )
            v = read_only(answer.velocity)
            applied = started.apply(v, limits)
            steps.append(
                (q, clock.tau, desired, jacobian, v, applied, answer.status, int(problem.relaxed))
            )
            before, q = q, read_only(pin.integrate(model, q, applied * dt))
            clock.advance(q)
            if watches:
                started.watch(Step(k + 1, before, q, v_prev, applied))
            v_prev = applied
    except TrialEnded as ended:
        status, message = ended.status, f"step {len(steps)}: {ended}"
    except ProtectiveStop as stop:
        status, message = Status.PROTECTIVE_STOP, f"step {len(steps) - 1}: {stop}"
    trace, jacobians = _joined_record(scenario, steps, q, clock.tau, solve.rechecked(), mode)
    return Run(trace, status, message, kinematics_ns, formulation_ns, jacobians)


def _joined_record(
    scenario: Scenario,
    steps: list[_Step],
    q: Array,
    tau: float,
    rechecked: RecheckedSteps,
    mode: ReferenceMode,
) -> tuple[Trace, Array]:
    """Make the trace and the Jacobians (n, m, nv) of steps that ended in q at tau."""
    nv, m = scenario.robot.nv, len(scenario.rows)
    columns = [*zip(*steps, strict=True)] or [()] * 8
    before, taus, desired, jacobian_list, commanded, applied, statuses, relaxed = columns
    jacobians = _joined(jacobian_list, m, nv)
    trace = recorded(
        scenario,
        _joined((*before, q), scenario.robot.nq),
        np.array([*taus, tau]),
        _joined(desired, m),
        jacobians,
        _joined(commanded, nv),
        _joined(applied, nv),
        np.array([STEP_STATUSES.index(each) for each in statuses], dtype=int),
        np.array(relaxed, dtype=int),
        rechecked,
        mode,
    )
    return trace, jacobians


def recorded(
    scenario: Scenario,
    q: Array,
    tau: Array,
    desired: Array,
    jacobians: Array,
    commanded: Array,
    applied: Array,
    status: Indices,
    relaxed: Indices,
    rechecked: RecheckedSteps,
    mode: ReferenceMode,
) -> Trace:
    """Make the trace of n control steps; for the arguments see `Trace`.

    Steps whose solver lied become `not-verified`, those that made less than `STUCK_PROGRESS` of the
    desired motion `stuck`. The Jacobians (n, m, nv) are the formulation's.
    """
    n = len(applied)
    achieved = np.einsum("kij,kj->ki", jacobians, commanded)
    weights = row_weights(scenario.rows, scenario.characteristic_length)
    alpha = progress(desired, achieved, weights)
    ok = STEP_CODE[Status.OK]
    status = status.copy()
    status[(status == ok) & rechecked.lied[:n]] = STEP_CODE[Status.NOT_VERIFIED]
    status[(status == ok) & (alpha < STUCK_PROGRESS)] = STEP_CODE[Status.STUCK]
    return Trace(
        scenario.dt,
        q,
        tau,
        desired,
        commanded,
        applied,
        status,
        relaxed,
        rechecked.claimed[:n],
        rechecked.verified[:n],
        rechecked.primal[:n],
        rechecked.dual[:n],
        rechecked.gap[:n],
        rechecked.distance[:n],
        mode,
    )


def _joined(parts: Sequence[Array], *shape: int) -> Array:
    """Join arrays of one shape into one, (len(parts), *shape)."""
    return np.concatenate(parts or [np.empty((0, *shape))]).reshape(len(parts), *shape)
