"""Clocks: how a reference moves on during a trial, with time or with the robot."""

from __future__ import annotations

from collections.abc import Mapping
from types import MappingProxyType
from typing import Any, Final, Literal, Protocol

import pinocchio as pin

from dikbench.arrays import Array
from dikbench.scenario.scenario import Scenario

ReferenceMode = Literal["time", "path"]

LOOK_BACK_S: Final = 0.1
"""The nearest point of the path is looked for from so long before the target on [s]."""

PATH_END_TOLERANCE: Final = 1e-9
"""A path has ended when at most this share of it is left."""


class Clock(Protocol):
    """The nominal time of a trial, which begins at 0 and moves on at every control step.

    Attributes:
        tau: nominal time on the reference [s].
        most_steps: number of control steps after which the trial is over in any case.
    """

    tau: float
    most_steps: int

    def __init__(self, scenario: Scenario) -> None: ...

    @property
    def is_over(self) -> bool:
        """Whether the trial has come to its end."""
        ...

    def target(self) -> tuple[Any, Any]:
        """Placement (`pinocchio.SE3`) and body twist (`pinocchio.Motion`) of the reference."""
        ...

    def advance(self, q: Array) -> None:
        """Move on after a control step that ended in the configuration q (nq,)."""
        ...


class TimeClock:
    """Moves on by one control period at every step, whatever the robot does: tau = k dt."""

    def __init__(self, scenario: Scenario) -> None:
        self.tau = 0.0
        self.most_steps = scenario.steps
        self._step, self._dt, self._targets = 0, scenario.dt, scenario.targets

    @property
    def is_over(self) -> bool:
        """Whether the scenario's duration has passed."""
        return self._step == self.most_steps

    def target(self) -> tuple[Any, Any]:
        """See `Clock`; the targets are computed once for all trials of a scenario."""
        target: tuple[Any, Any] = self._targets[self._step]
        return target

    def advance(self, q: Array) -> None:
        """Move on by one control period (see `Clock`)."""
        self._step += 1
        self.tau = self._step * self._dt


class PathClock:
    """Waits for the robot: follows the nearest point of the path, at most at the nominal pace.

        tau <- min(tau + dt, max(tau, tau_near + dt))

    with tau_near the nominal time of the path's nearest point to where the task frame is after the
    step, in position and orientation (see `Embedding`), among those of
    [tau - `LOOK_BACK_S`, tau + 2 dt]; the latest of equally near ones. An exact motion moves at the
    nominal pace, and so does one that is late by less than a control period; a dwell, whose points
    are all equally near, passes in full.
    """

    def __init__(self, scenario: Scenario) -> None:
        assert scenario.embedded_path is not None
        self.tau = 0.0
        self.most_steps = max(1, round(scenario.longest_path_run * scenario.steps))
        self._step, self._dt, self._target = 0, scenario.dt, scenario.target
        self._duration = scenario.reference.duration
        self._path, self._embedding = scenario.embedded_path, scenario.embedding
        self._frame, self._model = scenario.robot.frame_id, scenario.robot.model
        self._data = self._model.createData()

    @property
    def is_over(self) -> bool:
        """Whether the path has ended, or the scenario's `longest_path_run` is over."""
        return path_has_ended(self.tau, self._duration) or self._step == self.most_steps

    def target(self) -> tuple[Any, Any]:
        """See `Clock`."""
        return self._target(self.tau)

    def advance(self, q: Array) -> None:
        """Move on to where the robot has come, at most by one control period (see `Clock`)."""
        pin.forwardKinematics(self._model, self._data, q)
        X = pin.updateFramePlacement(self._model, self._data, self._frame)
        point = self._embedding.points(X.rotation[None], X.translation[None])[0]
        first, last = self.tau - LOOK_BACK_S, self.tau + 2 * self._dt
        near = self._path.latest_nearest(point, max(first, 0.0), min(last, self._duration))
        ahead = min(self.tau + self._dt, max(self.tau, near + self._dt))
        self._step += 1
        self.tau = min(ahead, self._duration)


def path_has_ended(tau: float, duration: float) -> bool:
    """Return whether a nominal time [s] is the end of a path of this nominal duration [s]."""
    return tau >= duration * (1 - PATH_END_TOLERANCE)


CLOCKS: Final[Mapping[ReferenceMode, type[Clock]]] = MappingProxyType(
    {"time": TimeClock, "path": PathClock}
)
