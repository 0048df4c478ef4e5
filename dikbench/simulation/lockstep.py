"""Many closed loops of robots of one kind, a control step of all at a time.

It is the same loop as `dikbench.simulation.closed_loop.simulate`, which stays the truth: a row that
has no answer when all are asked together is asked alone, by `control_step`.
"""

from __future__ import annotations

from collections.abc import Hashable, Sequence
from dataclasses import dataclass
from itertools import groupby
from typing import NamedTuple

import numpy as np
import pinocchio as pin

from dikbench.arrays import Array, Indices, Mask, read_only
from dikbench.problem.problem import DikProblem, Formulation
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
from dikbench.simulation.asking_together import AskedTogether, part_of
from dikbench.simulation.clock import ReferenceMode
from dikbench.simulation.closed_loop import (
    DIVERGED_ERROR,
    DIVERGED_SPEED_RAD_S,
    ERROR_CHECK_PERIOD_STEPS,
    Run,
)
from dikbench.simulation.control_step import TrialEnded, control_step
from dikbench.simulation.lockstep_records import LockstepRecords
from dikbench.simulation.many_clocks import MANY_CLOCKS
from dikbench.simulation.status import STEP_CODE, Status
from dikbench.solvers.checked_solve import CheckedSolve


def kind_of(scenario: Scenario) -> Hashable | None:
    """Return what scenarios must share to be run in lockstep; None where one runs alone.

    It is the robot with its limits, the tracked rows, the kinds of its tasks, and dt. Scenarios
    with rows G v <= h, several tasks of one priority, tasks on other frames or of single angular
    rows run alone, and those whose distance from the path is by the task's error.
    """
    robot = scenario.robot
    tracking = kind_of_tracking(scenario.tracking, robot)
    others = [kind_of_task(task) for task in scenario.tasks]
    priorities = [scenario.tracking.priority, *(task.priority for task in scenario.tasks)]
    by_error = scenario.embedding.by_error
    if scenario.constraints or tracking is None or None in others or by_error:
        return None
    if len(set(priorities)) < len(priorities):
        return None
    known = robot.available_acceleration
    own = (
        id(robot.model), robot.name, robot.frame_id, robot.q0.tobytes(), robot.urdf, robot.srdf,
        robot.movable_rows, None if known is None else known.tobytes(), _limits_key(robot.limits),
    )  # fmt: skip
    return own, tracking, *others, scenario.dt


def _limits_key(limits: JointLimits) -> Hashable:
    kinds = (limits.position, limits.velocity, limits.acceleration, limits.effort)
    return tuple(each and (each.lower.tobytes(), each.upper.tobytes()) for each in kinds)


class LockstepTrial(NamedTuple):
    """A trial to be run in lockstep.

    Attributes:
        scenario: its case.
        formulation: the formulation under test; trials of one object are asked together.
        solve: its solver.
        seed: seed of the plant's noise.
        guesses: see `ManySolve`.
    """

    scenario: Scenario
    formulation: Formulation
    solve: CheckedSolve
    seed: int
    guesses: bool


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
    trials: Sequence[LockstepTrial], plant: Plant, mode: ReferenceMode
) -> list[LockstepRun]:
    """Run formulations in closed loop over scenarios of one kind (see `kind_of`).

    A trial's numbers do not depend on the others, to the bit.

    Args:
        trials: the cases and the formulations under test.
        plant: the measurement and the drive.
        mode: whether the references advance with the clock or wait for the robots.
    """
    order = sorted(range(len(trials)), key=lambda k: _asked_as_one(trials[k]))
    loop = _Lockstep([trials[k] for k in order], plant, mode)
    while len(loop.running):
        loop.step()
    found = {k: loop.finished(row) for row, k in enumerate(order)}
    return [found[k] for k in range(len(trials))]


def _asked_as_one(trial: LockstepTrial) -> tuple[int, bool, float]:
    """Return what trials share that are asked together."""
    return id(trial.formulation), trial.guesses, trial.solve.tolerance


class _Lockstep:
    """The state of the trials that are still running, a row each; neighbours by formulation."""

    def __init__(self, trials: Sequence[LockstepTrial], plant: Plant, mode: ReferenceMode) -> None:
        scenarios = [trial.scenario for trial in trials]
        first = scenarios[0]
        self.trials, self.mode = trials, mode
        self.robot, self.dt, self.tracking = first.robot, first.dt, first.tracking
        self.kinematics = ManyKinematics(self.robot)
        self.clock = MANY_CLOCKS[mode](scenarios)
        self.plant = ManyStarted(plant, scenarios, [trial.seed for trial in trials])
        self.records = LockstepRecords(scenarios, self.clock.most_steps)
        self.asked: list[AskedTogether] = []
        for _, group in groupby(trials, _asked_as_one):
            done = sum(len(each.solves) for each in self.asked)
            own = list(group)
            solves = [trial.solve for trial in own]
            self.asked.append(
                AskedTogether(own[0].formulation, done, solves, guesses=own[0].guesses)
            )
        for trial, steps in zip(trials, self.clock.most_steps, strict=True):
            trial.solve.begin_run(steps)
        self.running: Indices = np.arange(len(trials))
        self.q = np.array([scenario.q0 for scenario in scenarios])
        self.v_prev = np.array([scenario.v0 for scenario in scenarios])
        self.postures = [
            np.array([getattr(scenario.tasks[n], "target", ()) for scenario in scenarios])
            for n in range(len(first.tasks))
        ]
        self.k = 0
        self.records.instant(0, self.running, self.q, self.clock.tau())
        self._drop(self.clock.over())

    def step(self) -> None:
        """Take one control step of all trials that are running."""
        k, running, robot = self.k, self.running, self.robot
        seen = self.plant.seen(self.q)
        self.kinematics.update(seen)
        targets = self.clock.targets()
        problem = self._problem(seen, targets)
        priority = self.tracking.priority
        tracked = next(task for task in problem.tasks if task.priority == priority)
        v, alone, relaxed = self._ask(problem)
        status, out = np.zeros(len(running), dtype=int), np.zeros(len(running), dtype=bool)
        if k % ERROR_CHECK_PERIOD_STEPS == 0:
            out = np.vecdot(tracked.error, tracked.error) > DIVERGED_ERROR**2
            self._end(out, Status.DIVERGED, f"task error above {DIVERGED_ERROR:g} m, rad")
        for row in np.flatnonzero(alone & ~out).tolist():
            own = self._row(problem, targets, row)
            trial = self.trials[running[row]]
            self.records.asked_alone[running[row]] += 1
            try:
                with np.errstate():  # what it sets is not for others
                    answer = control_step(trial.formulation, own, trial.solve, k)
            except TrialEnded as ended:
                out[row] = True
                self.records.ended[int(running[row])] = ended.status, f"step {k}: {ended}"
                continue
            v[row], status[row] = answer.velocity, STEP_CODE[answer.status]
            relaxed[row] = own.relaxed
        fast = ~out & (np.vecdot(v, v) > DIVERGED_SPEED_RAD_S**2)
        self._end(fast, Status.DIVERGED, f"commanded speed above {DIVERGED_SPEED_RAD_S:g} rad/s")
        kept: Indices | slice = slice(None)
        if (out := out | fast).any():
            kept = np.flatnonzero(~out)
            v, status, relaxed = v[kept], status[kept], relaxed[kept]
            self._drop(out)
            running = self.running
            if not len(running):
                return
        limits = Limits(robot.limits, _coordinates(robot.limits, self.q))
        applied = self.plant.apply(v, limits)
        self.records.step(k, running, tracked, kept, v, applied, status, relaxed)
        before, v_before = self.q, self.v_prev
        self.q, self.v_prev = moved(robot, self.q, applied * self.dt), applied
        self.clock.advance(self.q)
        self.k += 1
        self.records.instant(self.k, running, self.q, self.clock.tau())
        if self.plant.watches:
            self._watch(before, v_before, applied)
        self._drop(self.clock.over())

    def _ask(self, problem: DikProblem) -> tuple[Array, Mask, Indices]:
        """Ask each formulation for its rows: velocities, who is to be asked alone, `relaxed`."""
        count = len(self.running)
        v, alone = np.empty((count, self.robot.nv)), np.empty(count, dtype=bool)
        relaxed = np.zeros(count, dtype=int)
        for each in self.asked:
            part = part_of(problem, each.rows)
            v[each.rows], alone[each.rows] = each.ask(part)
            relaxed[each.rows] = part.relaxed
            if each.rechecked is not None:
                rows = np.flatnonzero(~alone[each.rows])
                trials = self.running[each.rows][rows]
                self.records.rechecked(self.k, trials, each.rechecked, rows)
        return v, alone, relaxed

    def _end(self, out: Mask, status: Status, message: str) -> None:
        """Record why some rows end at this step."""
        for trial in self.running[out].tolist():
            self.records.ended[trial] = status, f"step {self.k}: {message}"

    def _watch(self, before: Array, v_before: Array, applied: Array) -> None:
        """Stop the trials that the plant stops."""
        out = np.zeros(len(self.running), dtype=bool)
        for row, trial in enumerate(self.running.tolist()):
            step = Step(self.k, before[row], self.q[row], v_before[row], applied[row])
            try:
                self.plant.watch(row, step)
            except ProtectiveStop as stop:
                out[row] = True
                message = f"step {self.k - 1}: {stop}"
                self.records.ended[trial] = Status.PROTECTIVE_STOP, message
        self._drop(out)

    def _drop(self, out: Mask) -> None:
        """Take rows out of the state of the running trials."""
        if not out.any():
            return
        kept, first = ~out, 0
        for each in self.asked:
            each.keep(kept, first)
            first += len(each.solves)
        self.asked = [each for each in self.asked if each.solves]
        self.running, self.q, self.v_prev = self.running[kept], self.q[kept], self.v_prev[kept]
        self.postures = [postures[kept] for postures in self.postures]
        self.clock.keep(kept)
        self.plant.keep(kept)

    def _problem(self, seen: Array, targets: ManyTargets) -> DikProblem:
        """Pose the problems of all rows."""
        tasks = [linearize_tracking(self.tracking, self.robot, self.kinematics, targets)]
        for task, postures in zip(self.trials[0].scenario.tasks, self.postures, strict=True):
            tasks.append(linearize_task(task, self.robot, seen, postures))
        for part in (seen, self.v_prev, *(x for t in tasks for x in (t.J, t.V, t.error))):
            part.setflags(write=False)
        limits = Limits(self.robot.limits, _coordinates(self.robot.limits, seen))
        return DikProblem(self.robot, seen, self.v_prev, self.dt, tasks, limits)

    def _row(self, problem: DikProblem, targets: ManyTargets, row: int) -> DikProblem:
        """Pose the problem of one row, as it would be posed alone."""
        scenario, k = self.trials[self.running[row]].scenario, self.kinematics
        X = pin.SE3(k.rotations[row], k.translations[row])
        relative = X.actInv(pin.SE3(targets.rotations[row], targets.translations[row]))
        given = sorted((scenario.tracking, *scenario.tasks), key=lambda task: task.priority)
        q, v_prev = problem.q[row], self.v_prev[row]
        tasks = [
            row_of(many, row, task, self.robot, relative)
            for many, task in zip(problem.tasks, given, strict=True)
        ]
        return DikProblem(self.robot, q, v_prev, self.dt, tasks, self.robot.limits.at(q))

    def finished(self, row: int) -> LockstepRun:
        """Return a trial that is over."""
        run = self.records.run(row, self.trials[row].solve.rechecked(), self.mode)
        return LockstepRun(run, int(self.records.asked_alone[row]))


def _coordinates(limits: JointLimits, q: Array) -> Array | None:
    """Return what position limits bound of configurations (N, nq), (N, nv), read-only."""
    return None if limits.position is None else read_only(q[:, limits.q_index])
