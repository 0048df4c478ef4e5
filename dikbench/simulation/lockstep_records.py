"""The records of trials that run in lockstep."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from dikbench.arrays import Array, Indices
from dikbench.problem.tasks.task import LinearizedTask
from dikbench.scenario.scenario import Scenario
from dikbench.simulation.clock import ReferenceMode
from dikbench.simulation.closed_loop import Run, recorded
from dikbench.simulation.status import Status
from dikbench.solvers.recheck.rechecked import NO_PROGRAM, RecheckedSteps


class LockstepRecords:
    """What N trials did at each control step: arrays with a row per trial, its steps in a piece.

    Attributes:
        taken: number of control steps of each, (N,).
        ended: status and message of those that did not run to their end, by number.
        asked_alone: number of control steps at which each was asked alone, (N,).
    """

    def __init__(self, scenarios: Sequence[Scenario], most_steps: Sequence[int]) -> None:
        first, count, most = scenarios[0], len(scenarios), max(most_steps)
        nq, nv, m = first.robot.nq, first.robot.nv, len(first.rows)
        self._scenarios = scenarios
        self._q, self._tau = np.empty((count, most + 1, nq)), np.empty((count, most + 1))
        self._desired, self._jacobians = np.empty((count, most, m)), np.empty((count, most, m, nv))
        self._commanded, self._applied = np.empty((2, count, most, nv))
        self._status, self._relaxed = np.zeros((2, count, most), dtype=int)
        nothing = RecheckedSteps(most)
        self._rechecked = {
            name: np.tile(getattr(nothing, name), (count, 1)) for name in RecheckedSteps.__slots__
        }
        self.taken = np.zeros(count, dtype=int)
        self.ended: dict[int, tuple[Status, str]] = {}
        self.asked_alone = np.zeros(count, dtype=int)

    def instant(self, k: int, trials: Indices, q: Array, tau: Array) -> None:
        """Record configurations (n, nq) and nominal times (n,) [s] before step k of some trials."""
        rows = self._rows(trials)
        self._q[rows, k], self._tau[rows, k] = q, tau

    def step(
        self,
        k: int,
        trials: Indices,
        tracked: LinearizedTask,
        kept: Indices | slice,
        commanded: Array,
        applied: Array,
        status: Indices,
        relaxed: Indices,
    ) -> None:
        """Record step k of some trials; for the arrays see `Trace`.

        Args:
            k: number of the step.
            trials: their numbers, (n,).
            tracked: the tracking task of these and others.
            kept: the rows of it that are theirs.
            commanded: (n, nv).
            applied: (n, nv).
            status: (n,).
            relaxed: (n,).
        """
        rows = self._rows(trials)
        self._desired[rows, k], self._jacobians[rows, k] = tracked.V[kept], tracked.J[kept]
        self._commanded[rows, k], self._applied[rows, k] = commanded, applied
        self._status[rows, k], self._relaxed[rows, k] = status, relaxed
        self.taken[rows] = k + 1

    def rechecked(self, k: int, trials: Indices, found: RecheckedSteps, rows: Indices) -> None:
        """Record the recheck of what was solved at step k for some trials together."""
        for name, records in self._rechecked.items():
            records[trials, k] = getattr(found, name)[rows]

    def _rows(self, trials: Indices) -> Indices | slice:
        """Return how the rows of trials are found: all of them as one piece."""
        return slice(None) if len(trials) == len(self.taken) else trials

    def run(self, trial: int, alone: RecheckedSteps, mode: ReferenceMode) -> Run:
        """Return a trial that is over.

        Args:
            trial: its number.
            alone: the recheck of the steps at which it was asked alone.
            mode: what advanced its reference.
        """
        n, scenario = int(self.taken[trial]), self._scenarios[trial]
        together = alone.claimed == NO_PROGRAM
        for name, records in self._rechecked.items():
            own = getattr(alone, name)
            own[together] = records[trial, : len(own)][together]
        status, message = self.ended.get(trial, (Status.OK, ""))
        jacobians = self._jacobians[trial, :n]
        trace = recorded(
            scenario,
            self._q[trial, : n + 1],
            self._tau[trial, : n + 1],
            self._desired[trial, :n],
            jacobians,
            self._commanded[trial, :n],
            self._applied[trial, :n],
            self._status[trial, :n],
            self._relaxed[trial, :n],
            alone,
            mode,
        )
        return Run(trace, status, message, 0, 0, jacobians)
