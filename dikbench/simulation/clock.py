"""Clocks: how a reference advances during a trial, with time or with the robot."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from types import MappingProxyType
from typing import Any, Final, Literal, Protocol

import numpy as np
import pinocchio as pin

from dikbench.arrays import Array
from dikbench.scenario.scenario import Scenario

ReferenceMode = Literal["time", "path"]

LOOK_BACK_S: Final = 0.1
"""Nominal time before the target from which on the nearest point of the path is searched."""

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

    def advance(self, q: Array) -> None:
        """Advance after a control step that ended in the configuration q, (nq,)."""
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

    def advance(self, q: Array) -> None:
        """Advance by one control period (see `Clock`)."""
        self._step += 1
        self.tau = self._step * self._dt


class PathClock:
    """Waits for the robot: follows the nearest point of the path, at most at the nominal pace.

        tau <- min(tau + dt, max(tau, tau_near + dt))

    with tau_near the nominal time of the path's nearest point to the task frame after the step, in
    position and orientation (see `Embedding`), in the window [tau - `LOOK_BACK_S`, tau + 2 dt]; the
    latest of equally near ones. An exact motion advances at the nominal pace, and so does one that
    is late by less than a control period; a dwell, whose points are all equally near, passes in
    full. The trial is over when the path has ended, or after `Scenario.longest_path_run` times its
    nominal duration.
    """

    def __init__(self, scenario: Scenario) -> None:
        assert scenario.embedded_path is not None
        self.tau = 0.0
        self._dt, self._target = scenario.dt, scenario.target
        self._duration = scenario.reference.duration
        self.most_steps = most_path_steps(scenario)
        self._path, self._scenario = scenario.embedded_path, scenario
        self._frame, self._model = scenario.robot.frame_id, scenario.robot.model
        self._data = self._model.createData()

    def __iter__(self) -> Iterator[tuple[Any, Any]]:
        """Give the reference (see `Clock`)."""
        for _ in range(self.most_steps):
            if path_has_ended(self.tau, self._duration):
                break
            yield self._target(self.tau)

    def advance(self, q: Array) -> None:
        """Advance to where the robot is, at most by one control period (see `Clock`)."""
        pin.forwardKinematics(self._model, self._data, q)
        X = pin.updateFramePlacement(self._model, self._data, self._frame)
        made, embedding = (X.rotation[None], X.translation[None]), self._scenario.embedding
        if embedding.by_error:
            target = self._scenario.reference.placement(self.tau)
            wanted = target.rotation[None], target.translation[None]
            point = self._scenario.points_at(np.array([self.tau]), made, wanted)[0][0]
        else:
            point = embedding.points(*made)[0]
        first, last = self.tau - LOOK_BACK_S, self.tau + 2 * self._dt
        near = self._path.latest_nearest(point, max(first, 0.0), min(last, self._duration))
        ahead = min(self.tau + self._dt, max(self.tau, near + self._dt))
        self.tau = min(ahead, self._duration)


def most_path_steps(scenario: Scenario) -> int:
    """Return the largest number of control steps of a trial whose reference waits."""
    longest = scenario.longest_path_run * scenario.reference.duration
    return max(1, round(longest / scenario.dt))


def path_has_ended(tau: Any, duration: Any) -> Any:
    """Say whether a nominal time [s] is the end of a path of this nominal duration [s]; or each."""
    return tau >= duration * (1 - PATH_END_TOLERANCE)


CLOCKS: Final[Mapping[ReferenceMode, type[Clock]]] = MappingProxyType(
    {"time": TimeClock, "path": PathClock}
)
