"""The clocks of many trials that run in lockstep (see `dikbench.simulation.clock`)."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from types import MappingProxyType
from typing import Final, Protocol

import numpy as np

from dikbench.arrays import Array, Mask
from dikbench.problem.tasks.many_tasks import ManyTargets
from dikbench.robots.many_kinematics import ManyKinematics
from dikbench.scenario.reference.many_paths import ManyPaths
from dikbench.scenario.scenario import Scenario
from dikbench.simulation.clock import (
    LOOK_BACK_S,
    ReferenceMode,
    most_path_steps,
    path_has_ended,
)


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
        own = {id(scenario): scenario for scenario in scenarios}  # of several trials each
        places = {name: place for place, name in enumerate(own)}
        self._rows = np.array([places[id(scenario)] for scenario in scenarios])
        self._left = np.array(self.most_steps)
        count, most = len(own), max(self.most_steps)
        self._rotations = np.empty((most, count, 3, 3))
        self._translations, self._twists = np.empty((most, count, 3)), np.empty((most, count, 6))
        for row, scenario in enumerate(own.values()):
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
        paths = [scenario.embedded_path for scenario in scenarios]
        found = [path for path in paths if path is not None]
        assert len(found) == len(paths)
        self._scenarios, self._dt = list(scenarios), scenarios[0].dt
        self.most_steps: Sequence[int] = [most_path_steps(scenario) for scenario in scenarios]
        self._left = np.array(self.most_steps)
        self._durations = np.array([scenario.reference.duration for scenario in scenarios])
        self._step, self._tau = 0, np.zeros(len(scenarios))
        self._rows = np.arange(len(scenarios))
        self._paths = ManyPaths(found, LOOK_BACK_S + 2 * self._dt)
        self._kinematics = ManyKinematics(scenarios[0].robot)
        self._alike = all(
            scenario.embedding.is_like(scenarios[0].embedding) for scenario in scenarios
        )

    def targets(self) -> ManyTargets:
        """See `ManyClocks`."""
        pairs = [
            scenario.target(tau)
            for scenario, tau in zip(self._scenarios, self._tau.tolist(), strict=True)
        ]
        return ManyTargets(
            np.array([X.rotation for X, _ in pairs]),
            np.array([X.translation for X, _ in pairs]),
            np.array([twist.vector for _, twist in pairs]),
        )

    def tau(self) -> Array:
        """See `ManyClocks`."""
        return self._tau

    def advance(self, q: Array) -> None:
        """See `ManyClocks`."""
        self._step += 1
        self._kinematics.update(q)
        R, p = self._kinematics.rotations, self._kinematics.translations
        if self._alike:
            points = self._scenarios[0].embedding.points(R, p)
        else:  # what is asked for is in the axes of each target
            each = zip(self._scenarios, R[:, None], p[:, None], strict=True)
            points = np.concatenate([s.embedding.points(*placed) for s, *placed in each])
        tau, dt, durations = self._tau, self._dt, self._durations
        first, last = np.maximum(tau - LOOK_BACK_S, 0.0), np.minimum(tau + 2 * dt, durations)
        near = self._paths.latest_nearest(self._rows, points, first, last)
        ahead = np.minimum(tau + dt, np.maximum(tau, near + dt))
        self._tau = np.minimum(ahead, durations)

    def over(self) -> Mask:
        """See `ManyClocks`."""
        over: Mask = (self._left <= self._step) | path_has_ended(self._tau, self._durations)
        return over

    def keep(self, kept: Mask) -> None:
        """See `ManyClocks`."""
        self._scenarios = [self._scenarios[row] for row in np.flatnonzero(kept).tolist()]
        self._rows, self._tau, self._left = self._rows[kept], self._tau[kept], self._left[kept]
        self._durations = self._durations[kept]


MANY_CLOCKS: Final[Mapping[ReferenceMode, type[ManyClocks]]] = MappingProxyType(
    {"time": ManyTimeClocks, "path": ManyPathClocks}
)
