"""Many closed loops of one robot and one formulation, a control step of all at a time.

It is the same loop as `dikbench.simulation.closed_loop.simulate`, which stays the truth: a row that
has no answer when all are asked together is asked alone, by `control_step`.
"""

from __future__ import annotations

from collections.abc import Hashable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import pinocchio as pin

from dikbench.arrays import Array, Indices, Mask
from dikbench.problem.problem import DikProblem, Formulation, is_batched
from dikbench.problem.tasks.many_tasks import (
    ManyTargets,
    kind_of_task,
    kind_of_tracking,
    linearize_task,
    linearize_tracking,
    row_of,
)
from dikbench.robots.kinematics import moved
from dikbench.robots.limits import JointLimits, Limits
from dikbench.robots.many_kinematics import ManyKinematics
from dikbench.scenario.plant import ManyStarted, Plant, ProtectiveStop, Step
from dikbench.scenario.scenario import Scenario
from dikbench.simulation.clock import ReferenceMode
from dikbench.simulation.closed_loop import (
    DIVERGED_ERROR,
    DIVERGED_SPEED_RAD_S,
    ERROR_CHECK_PERIOD_STEPS,
    Run,
    recorded,
)
from dikbench.simulation.control_step import TrialEnded, control_step
from dikbench.simulation.many_clocks import MANY_CLOCKS
from dikbench.simulation.status import STEP_CODE, Status
from dikbench.solvers.checked_solve import CheckedSolve
from dikbench.solvers.many_solve import ManySolve
from dikbench.solvers.recheck.rechecked import NO_PROGRAM, RecheckedSteps


def kind_of(scenario: Scenario) -> Hashable | None:
    """Return what scenarios must share to be run in lockstep; None where one runs alone.

    It is the robot with its limits, the tracked rows, the kinds of its tasks, and dt. Scenarios
    with rows G v <= h, several tasks of one priority, tasks on other frames or of single angular
    rows run alone.
    """
    robot = scenario.robot
    tracking = kind_of_tracking(scenario.tracking, robot)
    others = [kind_of_task(task) for task in scenario.tasks]
    priorities = [scenario.tracking.priority, *(task.priority for task in scenario.tasks)]
    if scenario.constraints or tracking is None or None in others:
        return None
    if len(set(priorities)) < len(priorities):
        return None
    return (
        id(robot.model),
        robot.frame_id,
        _limits_key(robot.limits),
        tracking,
        *others,
        scenario.dt,
    )


def _limits_key(limits: JointLimits) -> Hashable:
    kinds = (limits.position, limits.velocity, limits.acceleration, limits.effort)
    return tuple(each and (each.lower.tobytes(), each.upper.tobytes()) for each in kinds)


@dataclass(frozen=True, eq=False)
class LockstepRun:
    """A finished simulation of one of many trials.

    Attributes:
        run: as of a trial alone; without times, which have no meaning here.
        asked_alone: number of its control steps at which it was asked alone.
    """

    run: Run
    asked_alone: int


def simulate_together(
    scenarios: Sequence[Scenario],
    formulation: Formulation,
    solves: Sequence[CheckedSolve],
    plant: Plant,
    mode: ReferenceMode,
    seeds: Sequence[int],
    *,
    guesses: bool,
) -> list[LockstepRun]:
    """Run a formulation in closed loop over scenarios of one kind (see `kind_of`).

    A trial's numbers do not depend on the others, to the bit.

    Args:
        scenarios: the cases.
        formulation: the formulation under test.
        solves: the solver of each trial.
        plant: the measurement and the drive.
        mode: whether the references advance with the clock or wait for the robots.
        seeds: seeds of the plant's noise.
        guesses: see `ManySolve`.
    """
    loop = _Lockstep(scenarios, formulation, solves, plant, mode, seeds, guesses=guesses)
    while len(loop.running):
        loop.step()
    return [loop.finished(k) for k in range(len(scenarios))]


class _Lockstep:
    """The state of the trials that are still running, a row each, and the records of all."""

    def __init__(
        self,
        scenarios: Sequence[Scenario],
        formulation: Formulation,
        solves: Sequence[CheckedSolve],
        plant: Plant,
        mode: ReferenceMode,
        seeds: Sequence[int],
        *,
        guesses: bool,
    ) -> None:
        self.scenarios, self.formulation, self.solves, self.mode = (
            scenarios, formulation, solves, mode,
        )  # fmt: skip
        first = scenarios[0]
        self.robot, self.dt, self.tracking = first.robot, first.dt, first.tracking
        self.kinematics = ManyKinematics(self.robot)
        self.many = ManySolve(guesses=guesses) if is_batched(formulation) else None
        count, nv, m = len(scenarios), self.robot.nv, len(first.rows)
        self.clock = MANY_CLOCKS[mode](scenarios)
        self.plant = ManyStarted(plant, scenarios, seeds)
        self.running: Indices = np.arange(count)
        self.q = np.array([scenario.q0 for scenario in scenarios])
        self.v_prev = np.array([scenario.v0 for scenario in scenarios])
        self.k = 0
        most = max(self.clock.most_steps)
        self.taken = np.zeros(count, dtype=int)
        self.ended: dict[int, tuple[Status, str]] = {}
        self.alone = np.zeros(count, dtype=int)
        # A row each, so that a trial's record is one piece of memory.
        self.all_q = np.empty((count, most + 1, self.robot.nq))
        self.all_tau = np.empty((count, most + 1))
        self.desired = np.empty((count, most, m))
        self.jacobians = np.empty((count, most, m, nv))
        self.commanded = np.empty((count, most, nv))
        self.applied = np.empty((count, most, nv))
        self.status = np.zeros((count, most), dtype=int)
        self.relaxed = np.zeros((count, most), dtype=int)
        nothing = RecheckedSteps(most)
        self.rechecked = {
            name: np.tile(getattr(nothing, name), (count, 1)) for name in RecheckedSteps.__slots__
        }
        self.row_solves = [*solves]
        for solve, steps in zip(solves, self.clock.most_steps, strict=True):
            solve.begin_run(steps)
        self.postures = [
            np.array([getattr(scenario.tasks[n], "target", ()) for scenario in scenarios])
            for n in range(len(first.tasks))
        ]
        self.all_q[:, 0], self.all_tau[:, 0] = self.q, self.clock.tau()
        self._drop(self.clock.over())

    def step(self) -> None:
        """Take one control step of all trials that are running."""
        k, running = self.k, self.running
        seen = self.plant.seen(self.q)
        self.kinematics.update(seen)
        targets = self.clock.targets()
        problem = self._problem(seen, targets)
        tracked = problem.tasks[self._place_of_tracking(problem)]
        v, alone = np.full(self.v_prev.shape, np.nan), np.ones(len(running), bool)
        limits = Limits(self.robot.limits, _coordinates(self.robot.limits, self.q))
        far = np.zeros(len(running), bool)
        if k % ERROR_CHECK_PERIOD_STEPS == 0:
            far = ~(np.vecdot(tracked.error, tracked.error) <= DIVERGED_ERROR**2)
            far &= ~np.isnan(tracked.error).any(axis=1)
        if self.many is not None:
            v, alone = self._ask_together(problem)
        status, relaxed = np.zeros(len(running), dtype=int), np.zeros(len(running), dtype=int)
        relaxed[:] = problem.relaxed
        out = np.zeros(len(running), bool)
        for row in np.flatnonzero(alone | far).tolist():
            trial = int(running[row])
            try:
                if far[row]:
                    raise TrialEnded(Status.DIVERGED, f"task error above {DIVERGED_ERROR:g} m, rad")
                own = self._row(problem, targets, row)
                self.alone[trial] += 1
                answer = control_step(self.formulation, own, self.solves[trial], k)
                v[row], status[row] = answer.velocity, STEP_CODE[answer.status]
                relaxed[row] = own.relaxed
            except TrialEnded as ended:
                out[row] = True
                self.ended[trial] = ended.status, f"step {k}: {ended}"
        fast = ~out & (np.vecdot(v, v) > DIVERGED_SPEED_RAD_S**2)
        for row in np.flatnonzero(fast).tolist():
            self.ended[int(running[row])] = (
                Status.DIVERGED,
                f"step {k}: commanded speed above {DIVERGED_SPEED_RAD_S:g} rad/s",
            )
        out |= fast
        self._record_recheck(running[~alone], np.flatnonzero(~alone))
        self._drop(out)
        if out.any():
            kept = ~out
            v, status, relaxed = v[kept], status[kept], relaxed[kept]
            limits = Limits(self.robot.limits, _coordinates(self.robot.limits, self.q))
            running, tracked_V, tracked_J = self.running, tracked.V[kept], tracked.J[kept]
        else:
            tracked_V, tracked_J = tracked.V, tracked.J
        if not len(running):
            return
        applied = self.plant.apply(v, limits)
        self.desired[running, k], self.jacobians[running, k] = tracked_V, tracked_J
        self.commanded[running, k], self.applied[running, k] = v, applied
        self.status[running, k], self.relaxed[running, k] = status, relaxed
        before, v_before = self.q, self.v_prev
        self.q = moved(self.robot, self.q, applied * self.dt)
        self.v_prev = applied
        self.clock.advance(self.q)
        self.taken[running] += 1
        self.k += 1
        self.all_q[running, self.k], self.all_tau[running, self.k] = self.q, self.clock.tau()
        self._watch(before, v_before, applied)
        self._drop(self.clock.over())

    def _watch(self, before: Array, v_before: Array, applied: Array) -> None:
        """Stop the trials that the plant stops."""
        if not self.plant.watches:
            return
        out = np.zeros(len(self.running), bool)
        for row, trial in enumerate(self.running.tolist()):
            step = Step(self.k, before[row], self.q[row], v_before[row], applied[row])
            try:
                self.plant.watch(row, step)
            except ProtectiveStop as stop:
                out[row] = True
                self.ended[trial] = Status.PROTECTIVE_STOP, f"step {self.k - 1}: {stop}"
        self._drop(out)

    def _drop(self, out: Mask) -> None:
        """Take rows out of the state of the running trials."""
        if not out.any():
            return
        kept = ~out
        self.running, self.q, self.v_prev = self.running[kept], self.q[kept], self.v_prev[kept]
        self.postures = [postures[kept] for postures in self.postures]
        self.row_solves = [self.row_solves[row] for row in np.flatnonzero(kept).tolist()]
        self.clock.keep(kept)
        self.plant.keep(kept)

    def _problem(self, seen: Array, targets: ManyTargets) -> DikProblem:
        """Pose the problems of all rows."""
        tasks = [linearize_tracking(self.tracking, self.robot, self.kinematics, targets)]
        for task, postures in zip(self.scenarios[0].tasks, self.postures, strict=True):
            tasks.append(linearize_task(task, self.robot, seen, postures))
        limits = Limits(self.robot.limits, _coordinates(self.robot.limits, seen))
        return _read_only(DikProblem(self.robot, seen, self.v_prev, self.dt, tasks, limits))

    def _place_of_tracking(self, problem: DikProblem) -> int:
        """Return where the tracking task is among the tasks, which are sorted by priority."""
        priority = self.tracking.priority
        return next(n for n, task in enumerate(problem.tasks) if task.priority == priority)

    def _row(self, problem: DikProblem, targets: ManyTargets, row: int) -> DikProblem:
        """Pose the problem of one row, as it would be posed alone."""
        scenario, k = self.scenarios[int(self.running[row])], self.kinematics
        X = pin.SE3(k.rotations[row], k.translations[row])
        relative = X.actInv(pin.SE3(targets.rotations[row], targets.translations[row]))
        given = sorted((scenario.tracking, *scenario.tasks), key=lambda task: task.priority)
        q, v_prev = problem.q[row], self.v_prev[row]
        tasks = [
            row_of(many, row, task, self.robot, relative)
            for many, task in zip(problem.tasks, given, strict=True)
        ]
        return DikProblem(self.robot, q, v_prev, self.dt, tasks, self.robot.limits.at(q))

    def _ask_together(self, problem: DikProblem) -> tuple[Array, Mask]:
        """Ask for all rows at once: velocities (N, nv), and which rows have to be asked alone.

        Where that raises, each row is asked for as one of one, which has the same answer to the
        bit.
        """
        finite = _finite_rows(problem)
        v = self._together(problem, np.arange(len(self.running)))
        if v is None:
            v = np.full(self.v_prev.shape, np.nan)
            records = RecheckedSteps(len(self.running))
            for row in np.flatnonzero(finite).tolist():
                one = self._together(_rows(problem, [row]), np.array([row]))
                if one is not None and self.many is not None:
                    v[row] = one[0]
                    _copy(self.many.rechecked, 0, records, row)
            assert self.many is not None
            self.many.rechecked = records
        return v, ~finite | ~np.isfinite(v).all(axis=1)

    def _together(self, problem: DikProblem, rows: Indices) -> Array | None:
        """Ask for rows at once; None where that raises or is no array of velocities."""
        assert self.many is not None
        solves = self.row_solves
        whole = len(rows) == len(solves)
        self.many.begin_step(solves if whole else [solves[row] for row in rows.tolist()])
        try:
            answer: Any = self.formulation.velocity(problem, self.many)
        except MemoryError:
            raise
        except Exception:
            return None
        fits = isinstance(answer, np.ndarray) and answer.shape == self.v_prev[rows].shape
        return answer.copy() if fits and answer.dtype == float else None

    def _record_recheck(self, trials: Indices, rows: Indices) -> None:
        """Record the recheck of what was solved for all rows at once."""
        if self.many is None or (self.many.rechecked.claimed == NO_PROGRAM).all():
            return
        for name, records in self.rechecked.items():
            records[trials, self.k] = getattr(self.many.rechecked, name)[rows]

    def finished(self, trial: int) -> LockstepRun:
        """Return a trial that is over."""
        n, scenario = int(self.taken[trial]), self.scenarios[trial]
        rechecked = self.solves[trial].rechecked()
        together = rechecked.claimed == NO_PROGRAM
        for name, records in self.rechecked.items():
            own = getattr(rechecked, name)
            own[together] = records[trial, : len(own)][together]
        status, message = self.ended.get(trial, (Status.OK, ""))
        jacobians = self.jacobians[trial, :n]
        trace = recorded(
            scenario,
            self.all_q[trial, : n + 1],
            self.all_tau[trial, : n + 1],
            self.desired[trial, :n],
            jacobians,
            self.commanded[trial, :n],
            self.applied[trial, :n],
            self.status[trial, :n],
            self.relaxed[trial, :n],
            rechecked,
            self.mode,
        )
        run = Run(trace, status, message, 0, 0, jacobians)
        return LockstepRun(run, int(self.alone[trial]))


def _coordinates(limits: JointLimits, q: Array) -> Array | None:
    """Return what position limits bound of configurations (N, nq), (N, nv)."""
    return None if limits.position is None else q[:, limits.q_index]


def _finite_rows(problem: DikProblem) -> Mask:
    """Say which rows hold numbers alone, (N,)."""
    finite: Any = np.isfinite(problem.q).all(axis=1)
    if problem.v_prev is not None:
        finite &= np.isfinite(problem.v_prev).all(axis=1)
    for task in problem.tasks:
        finite &= np.isfinite(task.V).all(axis=1) & np.isfinite(task.error).all(axis=1)
        if task.J.ndim == 3:
            finite &= np.isfinite(task.J).all(axis=(1, 2))
    rows: Mask = finite
    return rows


def _rows(problem: DikProblem, rows: list[int]) -> DikProblem:
    """Return some rows of problems posed at once."""
    tasks = [
        type(task)(
            task.J if task.J.ndim == 2 else task.J[rows],
            task.V[rows], task.error[rows], task.weight, task.priority,
        )
        for task in problem.tasks
    ]  # fmt: skip
    coordinates, v_prev = problem.limits.coordinates, problem.v_prev
    limits = Limits(problem.limits.joint, None if coordinates is None else coordinates[rows])
    before = None if v_prev is None else v_prev[rows]
    return _read_only(DikProblem(problem.robot, problem.q[rows], before, problem.dt, tasks, limits))


def _read_only(problem: DikProblem) -> DikProblem:
    """Forbid writing to what a formulation is handed."""
    for part in (
        problem.q,
        problem.v_prev,
        *(x for t in problem.tasks for x in (t.J, t.V, t.error)),
    ):
        if part is not None:
            part.setflags(write=False)
    return problem


def _copy(source: RecheckedSteps, row: int, target: RecheckedSteps, step: int) -> None:
    for name in RecheckedSteps.__slots__:
        getattr(target, name)[step] = getattr(source, name)[row]
