"""The clocks of many trials that run in lockstep (see `dikbench.simulation.clock`)."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from types import MappingProxyType
from typing import Final, Protocol

import numpy as np

from dikbench.arrays import Array, Mask
from dikbench.problem.tasks.many_tasks import ManyTargets
from dikbench.scenario.scenario import Scenario
from dikbench.simulation.clock import PathClock, ReferenceMode, path_has_ended


class ManyClocks(Protocol):
    """The nominal times of N trials that are running.

    Attributes:
        most_steps: largest numbers of control steps, of all trials at the start.
    """

    most_steps: Sequence[int]

    def __init__(self, scenarios: Sequence[Scenario]) -> None: ...

    def targets(self) -> ManyTargets:
        """Return the references at this step."""
        ...

    def tau(self) -> Array:
        """Return the nominal times, (N,) [s]."""
        ...

    def advance(self, q: Array) -> None:
        """Advance after a control step that ended in the configurations q, (N, nq)."""
        ...

    def over(self) -> Mask:
        """Say which trials are over, (N,)."""
        ...

    def keep(self, kept: Mask) -> None:
        """Go on with some of the trials."""
        ...


class ManyTimeClocks:
    """Advance by one control period at every step (see `TimeClock`)."""

    def __init__(self, scenarios: Sequence[Scenario]) -> None:
        self.most_steps: Sequence[int] = [scenario.steps for scenario in scenarios]
        self._step, self._dt = 0, scenarios[0].dt
        self._rows, self._left = np.arange(len(scenarios)), np.array(self.most_steps)
        count, most = len(scenarios), max(self.most_steps)
        self._rotations = np.empty((most, count, 3, 3))
        self._translations, self._twists = np.empty((most, count, 3)), np.empty((most, count, 6))
        for row, scenario in enumerate(scenarios):
            rotations, translations = scenario.target_arrays
            n = scenario.steps
            self._rotations[:n, row], self._translations[:n, row] = rotations[:n], translations[:n]
            self._twists[:n, row] = scenario.target_twists[:n]

    def targets(self) -> ManyTargets:
        """See `ManyClocks`."""
        k, rows = self._step, self._rows
        return ManyTargets(
            self._rotations[k, rows], self._translations[k, rows], self._twists[k, rows]
        )

    def tau(self) -> Array:
        """See `ManyClocks`."""
        return np.full(len(self._rows), self._step * self._dt)

    def advance(self, q: Array) -> None:
        """See `ManyClocks`."""
        self._step += 1

    def over(self) -> Mask:
        """See `ManyClocks`."""
        over: Mask = self._left <= self._step
        return over

    def keep(self, kept: Mask) -> None:
        """See `ManyClocks`."""
        self._rows, self._left = self._rows[kept], self._left[kept]


class ManyPathClocks:
    """Wait for the robots, each for its own (see `PathClock`)."""

    def __init__(self, scenarios: Sequence[Scenario]) -> None:
        self._clocks = [PathClock(scenario) for scenario in scenarios]
        self._scenarios = list(scenarios)
        self.most_steps: Sequence[int] = [clock.most_steps for clock in self._clocks]
        self._step = 0

    def targets(self) -> ManyTargets:
        """See `ManyClocks`."""
        pairs = [
            scenario.target(clock.tau)
            for scenario, clock in zip(self._scenarios, self._clocks, strict=True)
        ]
        return ManyTargets(
            np.array([X.rotation for X, _ in pairs]),
            np.array([X.translation for X, _ in pairs]),
            np.array([twist.vector for _, twist in pairs]),
        )

    def tau(self) -> Array:
        """See `ManyClocks`."""
        return np.array([clock.tau for clock in self._clocks])

    def advance(self, q: Array) -> None:
        """See `ManyClocks`."""
        self._step += 1
        for clock, row in zip(self._clocks, q, strict=True):
            clock.advance(row)

    def over(self) -> Mask:
        """See `ManyClocks`."""
        return np.array(
            [
                self._step >= clock.most_steps
                or path_has_ended(clock.tau, scenario.reference.duration)
                for scenario, clock in zip(self._scenarios, self._clocks, strict=True)
            ],
            dtype=bool,
        )

    def keep(self, kept: Mask) -> None:
        """See `ManyClocks`."""
        rows = np.flatnonzero(kept).tolist()
        self._clocks = [self._clocks[row] for row in rows]
        self._scenarios = [self._scenarios[row] for row in rows]


MANY_CLOCKS: Final[Mapping[ReferenceMode, type[ManyClocks]]] = MappingProxyType(
    {"time": ManyTimeClocks, "path": ManyPathClocks}
)
