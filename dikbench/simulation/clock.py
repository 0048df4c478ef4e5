"""Clocks: how a reference advances during a trial, with time or with the progress achieved."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from types import MappingProxyType
from typing import Any, Final, Literal, Protocol

import numpy as np

from dikbench.arrays import Array
from dikbench.problem.progress import progress, row_weights
from dikbench.scenario.scenario import Scenario

ReferenceMode = Literal["time", "path"]

LONGEST_PATH_RUN_DURATIONS: Final = 5
"""Nominal durations after which a path-indexed run ends, if not with its path before."""

PATH_END_TOLERANCE: Final = 1e-9
"""Remaining share of a path at which it has ended."""


class Clock(Protocol):
    """The nominal time of a trial, which begins at 0 and advances at every control step.

    To iterate over it gives the reference at each step until the trial is over: its placement
    (`pinocchio.SE3`) and body twist (`pinocchio.Motion`). `advance` is called after each step.

    Attributes:
        tau: nominal time on the reference [s].
        most_steps: largest number of control steps of the trial.
    """

    tau: float
    most_steps: int

    def __init__(self, scenario: Scenario) -> None: ...

    def __iter__(self) -> Iterator[tuple[Any, Any]]:
        """Give the reference at each step."""
        ...

    def advance(self, desired: Array, jacobian: Array, applied: Array) -> None:
        """Advance after a control step.

        Args:
            desired: twist V of the tracking task, (m,) [m/s; rad/s].
            jacobian: its Jacobian J, (m, nv).
            applied: the velocity that the plant applied, (nv,) [rad/s or m/s].
        """
        ...


class TimeClock:
    """Advances by one control period at every step: tau = k dt."""

    def __init__(self, scenario: Scenario) -> None:
        self.tau = 0.0
        self.most_steps = scenario.steps
        self._step, self._dt, self._targets = 0, scenario.dt, scenario.targets

    def __iter__(self) -> Iterator[tuple[Any, Any]]:
        """Give the reference (see `Clock`), computed once for all trials of a scenario."""
        return iter(self._targets[: self.most_steps])

    def advance(self, desired: Array, jacobian: Array, applied: Array) -> None:
        """Advance by one control period (see `Clock`)."""
        self._step += 1
        self.tau = self._step * self._dt


class PathClock:
    """Waits for the robot: advances by the share of the desired motion that was achieved.

    tau <- tau + dt min(max(alpha, 0), 1) with alpha = <J v, V>/|V|^2 (see `progress`); where no
    motion is desired (a dwell) it moves on by dt. The trial is over when the path has ended, or
    after `LONGEST_PATH_RUN_DURATIONS` times its nominal duration.
    """

    def __init__(self, scenario: Scenario) -> None:
        self.tau = 0.0
        self.most_steps = LONGEST_PATH_RUN_DURATIONS * scenario.steps
        self._dt, self._target = scenario.dt, scenario.target
        self._duration = scenario.reference.duration
        self._weights = row_weights(scenario.rows)

    def __iter__(self) -> Iterator[tuple[Any, Any]]:
        """Give the reference (see `Clock`)."""
        for _ in range(self.most_steps):
            if self.tau >= self._duration * (1 - PATH_END_TOLERANCE):
                break
            yield self._target(self.tau)

    def advance(self, desired: Array, jacobian: Array, applied: Array) -> None:
        """Advance by the progress achieved (see `Clock`)."""
        achieved = jacobian @ applied
        alpha = float(progress(desired[None], achieved[None], self._weights)[0])
        share = 1.0 if np.isnan(alpha) else min(max(alpha, 0.0), 1.0)
        self.tau = min(self.tau + self._dt * share, self._duration)


CLOCKS: Final[Mapping[ReferenceMode, type[Clock]]] = MappingProxyType(
    {"time": TimeClock, "path": PathClock}
)
