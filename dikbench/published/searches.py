"""Inverse kinematics of positions by repeated steps of a formulation, restarted where it fails."""

from __future__ import annotations

from collections.abc import Mapping
from types import MappingProxyType
from typing import Any, ClassVar, Final, Literal

import msgspec
import numpy as np

from dikbench.arrays import Array, Indices, Mask
from dikbench.errors import CannotAnswer
from dikbench.plugins.building import make_formulation
from dikbench.problem.problem import DikProblem, Formulation, is_batched, program_of
from dikbench.problem.tasks import LinearizedTask, PoseTask
from dikbench.problem.tasks.many_tasks import ManyTargets, linearize_tracking
from dikbench.problem.tasks.pose import ErrorConvention
from dikbench.published.measured import (
    Measured,
    Statistic,
    of_count,
    of_mean,
    of_median,
    of_share,
)
from dikbench.robots.limits import Limits
from dikbench.robots.loading import load_robot
from dikbench.robots.many_kinematics import ManyKinematics
from dikbench.robots.robot import Robot
from dikbench.simulation.asking_together import part_of
from dikbench.solvers.catalogue.back_ends import DEFAULT_SOLVER, parse_solver
from dikbench.solvers.checked_solve import make_solve

TURN: Final = 2 * np.pi

TOGETHER: Final = 2000
"""Searches that take a step at once: what they need stays in the processor's cache."""


class Searches(msgspec.Struct, frozen=True, tag="searches", tag_field="protocol"):
    """Targets are placements at random configurations; a search starts at one of a shared list.

    A search makes full steps, q + v with the target's whole error to be made good (gain 1, dt 1),
    until E = 1/2 |e|^2 is below the tolerance before a step; that step is still made, joints are
    wrapped, and what is outside the position limits counts for nothing. Where the formulation has
    no finite step the search ends. The next one starts elsewhere, up to a number of searches.

    Attributes:
        robot: see `load_robot`.
        frame: see there.
        position_limit: +- this [rad], in place of the model's; None: the model's.
        seed: of numpy's legacy generator, of which the targets are drawn first, then the starts.
        targets: how many are drawn.
        first: how many of them are searched for; 0: all.
        searches: of each target at most.
        steps: of each search at most.
        tolerance: of E.
        convention: of the error (see `PoseTask`).
        within_limits: whether what is outside the position limits counts for nothing.
        wrap: joints into +-pi (`half-turn`) or into their limits (`limits`).
        steered_by_limits: whether the formulation sees the position limits.
    """

    robot: str
    frame: str | None = None
    position_limit: float | None = None
    seed: int = 0
    targets: int = 10_000
    first: int = 0
    searches: int = 100
    steps: int = 31
    tolerance: float = 1e-6
    convention: ErrorConvention = "decoupled"
    within_limits: bool = True
    wrap: Literal["half-turn", "limits"] = "half-turn"
    steered_by_limits: bool = True

    statistics: ClassVar[Mapping[str, Statistic]] = MappingProxyType(
        {
            "mean_iterations": Statistic("mean iterations"),
            "median_iterations": Statistic("median iterations", 1),
            "infeasible": Statistic("infeasible %"),
            "mean_searches": Statistic("mean searches"),
            "max_searches": Statistic("most searches", 0, extreme=True),
            "violations": Statistic("outside limits", 0),
        }
    )

    def measure(self, formulation: str) -> dict[str, Measured]:
        """Search for all targets with a formulation's selector."""
        robot = load_robot(self.robot, self.frame).with_limits(velocity=None)
        if self.position_limit is not None:
            bound = np.full(robot.nv, self.position_limit)
            robot = robot.with_limits(position=(-bound, bound))
        found = _Searching(self, robot, make_formulation(formulation)).run()
        reached = found.searches > 0
        iterations, searches = (
            each[reached].astype(float) for each in (found.iterations, found.searches)
        )
        others = self.targets if self.first else 0
        return {
            "mean_iterations": of_mean(iterations, others),
            "median_iterations": of_median(iterations),
            "infeasible": of_share(~reached, others),
            "mean_searches": of_mean(searches, others),
            "max_searches": Measured(float(searches.max(initial=0))),
            "violations": of_count(reached & found.outside),
        }


class _Found(msgspec.Struct):
    """What came of N targets, or of N searches.

    Attributes:
        iterations: steps until the target was reached, of all its searches, (N,).
        searches: the number of its searches, (N,); 0: never reached.
        outside: whether what was reached is outside the position limits, (N,).
    """

    iterations: Indices
    searches: Indices
    outside: Mask

    @classmethod
    def nothing(cls, count: int) -> _Found:
        """Return that of targets that are not searched for yet."""
        return cls(np.zeros(count, int), np.zeros(count, int), np.zeros(count, bool))


class _Searching:
    """All searches of an experiment, a step of many at a time."""

    def __init__(self, rules: Searches, robot: Robot, formulation: Formulation) -> None:
        position = robot.limits.position
        assert position is not None
        self._rules, self._robot, self._limits = rules, robot, position
        random = np.random.RandomState(rules.seed)  # the generator of the sources
        draws = [
            random.uniform(position.lower, position.upper, (count, robot.nv))
            for count in (rules.targets, rules.searches)
        ]
        self._starts = draws[1]
        self._kinematics = ManyKinematics(robot)
        self._kinematics.update(draws[0][: rules.first or None])
        self._rotations = self._kinematics.rotations
        self._translations = self._kinematics.translations
        self._task = PoseTask(convention=rules.convention)
        steered = robot if rules.steered_by_limits else robot.with_limits(position=None)
        self._seen = steered.limits
        self._formulation = formulation
        program = program_of(formulation)
        solver = None if program is None else parse_solver(DEFAULT_SOLVER[program])
        self._solve = make_solve(solver, program)
        self._together = program is None and is_batched(formulation)

    def run(self) -> _Found:
        """Search until each target is reached or given up.

        Searches do not depend on each other: where few targets are left, several of each are made
        at once, and the first that reaches it counts, unless each step is asked for alone.
        """
        left, tried = np.arange(len(self._translations)), 0
        found, at_once = _Found.nothing(len(left)), TOGETHER if self._together else 0
        while len(left) and tried < self._rules.searches:
            block = min(max(1, at_once // len(left)), self._rules.searches - tried)
            shape = len(left), block
            pairs = np.broadcast_to(left[:, None], shape), tried + np.indices(shape)[1]
            many = self._searched(*(np.ravel(each) for each in pairs))
            steps, reached = many.iterations.reshape(shape), many.searches.reshape(shape) > 0
            first, any_reached = reached.argmax(axis=1), reached.any(axis=1)
            last = np.where(any_reached, first, block - 1)
            rows = np.arange(len(left))
            found.iterations[left] += np.cumsum(steps, axis=1)[rows, last]
            found.searches[left] = np.where(any_reached, tried + first + 1, 0)
            found.outside[left] = many.outside.reshape(shape)[rows, last]
            left, tried = left[~any_reached], tried + block
        return found

    def _searched(self, target: Indices, start: Indices) -> _Found:
        """Make one search for each of n targets, from starts with the given numbers."""
        found = _Found.nothing(len(target))
        for first in range(0, len(target), TOGETHER):
            rows = np.arange(first, min(first + TOGETHER, len(target)))
            q = self._starts[start[rows]]
            for step in range(1, self._rules.steps + 1):
                found.iterations[rows] = step
                q, E, lost = self._stepped(q, target[rows])
                arrived = (E < self._rules.tolerance) & ~lost
                outside = self._outside(q[arrived])
                there = rows[arrived]
                found.searches[there] = ~(outside & self._rules.within_limits)
                found.outside[there] = outside
                going = ~arrived & ~lost
                rows, q = rows[going], q[going]
                if not len(rows):
                    break
        return found

    def _stepped(self, q: Array, target: Indices) -> tuple[Array, Array, Mask]:
        """Make a step; return also E before it, (N,), and where there is none, (N,)."""
        there: Array = q.copy()
        E: Array = np.full(len(q), np.inf)
        finite: Any = np.isfinite(q).all(axis=1)
        if finite.any():
            # Steps may lead as far as numbers go.
            with np.errstate(over="ignore", invalid="ignore"):
                there[finite], E[finite] = self._finite_step(q[finite], target[finite])
        return there, E, np.logical_not(finite)

    def _finite_step(self, q: Array, target: Indices) -> tuple[Array, Array]:
        """Make a step from configurations (n, nq); return also E before it, (n,)."""
        self._kinematics.update(q)
        targets = ManyTargets(
            self._rotations[target], self._translations[target], np.zeros((len(q), 6))
        )
        task = linearize_tracking(self._task, self._robot, self._kinematics, targets)
        seen = None if self._seen.position is None else q
        problem = DikProblem(self._robot, q, None, 1.0, [task], Limits(self._seen, seen))
        E: Array = 0.5 * np.vecdot(task.error, task.error)
        return q + self._velocity(problem), E

    def _velocity(self, problem: DikProblem) -> Array:
        """Ask for all rows at once, and alone for those that are not answered so, (n, nv)."""
        v = np.full(problem.q.shape, np.nan)
        if self._together:
            try:
                v = self._formulation.velocity(problem, self._solve)
            except np.linalg.LinAlgError:
                pass  # of one row; each is asked alone
        for row in np.flatnonzero(np.isnan(v).any(axis=1)).tolist():
            v[row] = self._velocity_alone(part_of(problem, slice(row, row + 1)))
        return v

    def _velocity_alone(self, one: DikProblem) -> Array:
        many, limits = one.tasks[0], one.limits
        task = LinearizedTask(many.J[0], many.V[0], many.error[0])
        seen = Limits(limits.joint, limits.coordinates if limits.coordinates is None else one.q[0])
        problem = DikProblem(one.robot, one.q[0], None, 1.0, [task], seen)
        try:
            return self._formulation.velocity(problem, self._solve)
        except (CannotAnswer, np.linalg.LinAlgError):
            return np.full(one.robot.nv, np.nan)

    def _outside(self, q: Array) -> Mask:
        """Say where joints, wrapped, are outside the position limits, (n,)."""
        lower, upper = self._limits.lower, self._limits.upper
        least = -np.pi if self._rules.wrap == "half-turn" else lower
        wrapped = (q - least) % TURN + least
        wrong: Any = np.logical_or(wrapped < lower, wrapped > upper).any(axis=1)
        outside: Mask = wrong
        return outside
