"""Plants: what a robot applies of a commanded velocity, and how its configuration is measured."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections import deque
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from types import MappingProxyType
from typing import Annotated, Final, NamedTuple

import numpy as np
import pinocchio as pin

from dikbench.arrays import Array, Mask, read_only
from dikbench.parameters import Parameters, Range
from dikbench.problem.constraints import CollisionConstraint, TorqueConstraint
from dikbench.robots.kinematics import moved
from dikbench.robots.limits import Limits
from dikbench.scenario.scenario import Scenario
from dikbench.scenario.violation import Violation, broken_limit, collision
from dikbench.scenario.witness import INSIDE_SHARE

LONGEST_DELAY_STEPS: Final = 1000

NOISE_STREAM: Final = 3
"""Number of the random stream of the noise, which differs from those of a seed's scenario."""


class ProtectiveStop(Exception):
    """The plant stopped the robot; the message says what was broken."""


class Step(NamedTuple):
    """A control step that was applied.

    Attributes:
        number: of the instant after it.
        q_before, q: configurations at its start and its end, (nq,).
        v_before, v: velocities before and in it, (nv,) [rad/s or m/s].
    """

    number: int
    q_before: Array
    q: Array
    v_before: Array
    v: Array


@dataclass(frozen=True)
class Plant(Parameters, ABC):
    """A drive with a noisy measurement and delayed commands.

    Attributes:
        noise: standard deviation of the measured configuration about the true one, per joint and
            step [rad or m]; white and normal, drawn from the trial's seed.
        delay: control steps by which a command arrives late; until the first one arrives the
            robot keeps its velocity at the start.
    """

    noise: Annotated[float, Range(0.0, unit="rad or m")] = 0.0
    delay: Annotated[int, Range(0, LONGEST_DELAY_STEPS, "steps")] = 0

    @abstractmethod
    def drive(self, v: Array, v_before: Array, limits: Limits, dt: float) -> Array:
        """Compute the velocity that is applied of a command that arrived, or of N of them.

        Args:
            v: the command, (nv,) or (N, nv) [rad/s or m/s], read-only.
            v_before: the velocity that was applied before, of its shape [rad/s or m/s], read-only.
            limits: the limits in force, as seen from the true configuration.
            dt: control period [s].
        """

    def watch(self, scenario: Scenario, step: Step) -> Violation | None:
        """Find what a step broke that ends the run; None, unless the plant stops the robot."""
        return None

    def start(self, scenario: Scenario, seed: int) -> StartedPlant:
        """Start a trial of a scenario, with a seed for the noise."""
        return StartedPlant(self, scenario, seed)


class StartedPlant:
    """A plant in one trial: its random numbers and the commands that have not arrived."""

    __slots__ = (
        "_applied", "_arriving", "_drive", "_dt", "_model", "_noise", "_random", "_scenario",
        "_watch",
    )  # fmt: skip

    def __init__(self, plant: Plant, scenario: Scenario, seed: int) -> None:
        self._drive, self._watch, self._noise = plant.drive, plant.watch, plant.noise
        self._scenario = scenario
        self._model, self._dt = scenario.robot.model, scenario.dt
        self._random = np.random.default_rng([seed, NOISE_STREAM])
        self._applied = read_only(scenario.v0.copy())
        self._arriving = deque([self._applied] * plant.delay)

    def seen(self, q: Array) -> Array:
        """Measure the true configuration, (nq,); without noise the result is `q` itself."""
        if not self._noise:
            return q
        error = self._random.normal(0.0, self._noise, self._model.nv)
        return read_only(pin.integrate(self._model, q, error))

    def apply(self, v: Array, limits: Limits) -> Array:
        """Send a command and apply the one that arrives in this control step.

        Args:
            v: the command, (nv,) [rad/s or m/s], read-only.
            limits: the limits in force, as seen from the true configuration.

        Returns:
            The velocity (nv,) with which the robot moves during this step, read-only.
        """
        self._arriving.append(v)
        arrived = self._arriving.popleft()
        applied = self._drive(arrived, self._applied, limits, self._dt)
        self._applied = applied if applied is arrived else read_only(applied)
        return self._applied

    def watch(self, step: Step) -> None:
        """Watch a step that was applied.

        Raises:
            ProtectiveStop: if the plant stops the robot for what the step broke.
        """
        broken = self._watch(self._scenario, step)
        if broken:
            raise ProtectiveStop(f"{broken.reason} = {broken.figure:.4g}")


class ManyStarted:
    """A plant in N trials that run in lockstep, a row each (see `StartedPlant`).

    Attributes:
        watches: whether it may stop a robot.
    """

    def __init__(self, plant: Plant, scenarios: Sequence[Scenario], seeds: Sequence[int]) -> None:
        self._plant = plant
        self._scenarios = list(scenarios)
        self._robot, self._dt = scenarios[0].robot, scenarios[0].dt
        self._random = [np.random.default_rng([seed, NOISE_STREAM]) for seed in seeds]
        self._applied = np.array([scenario.v0 for scenario in scenarios])
        self._arriving = deque([self._applied] * plant.delay)
        self.watches = type(plant).watch is not Plant.watch

    def seen(self, q: Array) -> Array:
        """Measure the true configurations, (N, nq); without noise the result is `q` itself."""
        if not self._plant.noise:
            return q
        nv = self._robot.nv
        errors = np.array([each.normal(0.0, self._plant.noise, nv) for each in self._random])
        return moved(self._robot, q, errors)

    def apply(self, v: Array, limits: Limits) -> Array:
        """Send commands (N, nv), and return the velocities with which the robots move."""
        self._arriving.append(v)
        arrived = self._arriving.popleft()
        self._applied = self._plant.drive(arrived, self._applied, limits, self._dt)
        return self._applied

    def watch(self, row: int, step: Step) -> None:
        """Watch a step that was applied (see `StartedPlant.watch`)."""
        broken = self._plant.watch(self._scenarios[row], step)
        if broken:
            raise ProtectiveStop(f"{broken.reason} = {broken.figure:.4g}")

    def keep(self, kept: Mask) -> None:
        """Go on with some of the trials."""
        rows = np.flatnonzero(kept).tolist()
        self._scenarios = [self._scenarios[row] for row in rows]
        self._random = [self._random[row] for row in rows]
        self._applied = self._applied[kept]
        self._arriving = deque([v[kept] for v in self._arriving])


@dataclass(frozen=True)
class Ideal(Plant):
    """Applies the command, limits or not, which shows violations."""

    def drive(self, v: Array, v_before: Array, limits: Limits, dt: float) -> Array:
        """Return the command (see `Plant.drive`)."""
        return v


@dataclass(frozen=True)
class Saturating(Plant):
    """Clips each joint to its limits, which shows direction errors.

    They are those of acceleration, where they are in force, of velocity and of position, one after
    the other: a position limit is an end stop, at which a joint stops at any deceleration.
    """

    def drive(self, v: Array, v_before: Array, limits: Limits, dt: float) -> Array:
        """Clip the command (see `Plant.drive`)."""
        acceleration, velocity = limits.joint.acceleration, limits.joint.velocity
        if acceleration is not None:
            v = np.clip(v, v_before + acceleration.lower * dt, v_before + acceleration.upper * dt)
        if velocity is not None:
            v = np.clip(v, velocity.lower, velocity.upper)
        if limits.to_lower is not None and limits.to_upper is not None:
            # A joint that is outside may not move further out, and is not moved back either.
            lower, upper = np.maximum(limits.to_lower, 0), np.maximum(limits.to_upper, 0)
            v = np.clip(v, -lower / dt, upper / dt)
        return v


@dataclass(frozen=True)
class Protective(Plant):
    """Applies the command and stops at the first limit or distance that is broken, as drives do."""

    def drive(self, v: Array, v_before: Array, limits: Limits, dt: float) -> Array:
        """Return the command (see `Plant.drive`)."""
        return v

    def watch(self, scenario: Scenario, step: Step) -> Violation | None:
        """Find what the step broke (see `Plant.watch`)."""
        robot, constraints = scenario.robot, scenario.constraints
        distances = [
            each.distances(robot, step.q[None]) - each.margin
            for each in constraints
            if isinstance(each, CollisionConstraint)
        ]
        torques = [
            each.torques(robot, step.q_before[None], step.v[None], step.v_before[None], scenario.dt)
            for each in constraints
            if isinstance(each, TorqueConstraint)
        ]
        effort = robot.limits.effort
        usage = np.empty(0)
        if torques and effort is not None:
            usage = effort.usage(torques[0]).max(axis=1)
        seconds = step.number * scenario.dt
        late = seconds >= INSIDE_SHARE * scenario.reference.duration
        return (distances and collision(np.min(distances, axis=0))) or broken_limit(
            robot,
            np.stack([scenario.q0, step.q]),
            np.array([False, late]),
            step.v[None],
            (step.v - step.v_before)[None] / scenario.dt,
            usage,
        )


PLANTS: Final[Mapping[str, type[Plant]]] = MappingProxyType(
    {"ideal": Ideal, "saturating": Saturating, "protective": Protective}
)


REFERENCE_MODES: Final = MappingProxyType(
    {
        "time": "the reference moves on with the clock",
        "path": "the reference moves on with the progress that was achieved",
    }
)
