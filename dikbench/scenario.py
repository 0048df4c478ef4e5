"""A scenario: a robot, a start, a reference motion, limits in force, and a certificate."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
import pinocchio as pin

from dikbench.array import Array
from dikbench.certificate import Certificate
from dikbench.references import Reference
from dikbench.robot import Robot
from dikbench.steps import steps_in
from dikbench.tasks.task import Task


@dataclass(frozen=True, eq=False)
class Scenario:
    """A closed-loop case, made once from parameters and a seed.

    Attributes:
        robot: the robot, with the limits that are in force.
        q0: start configuration, (nq,).
        v0: joint velocity at the start, (nv,) [rad/s]: the reference's own, so that a run does not
            begin with a jump from rest.
        reference: what the task frame should do.
        gain: gain of the tracking task, 1/s.
        dt: control period [s].
        duration: length of a time-indexed run [s].
        certificate: what makes the scenario what it is.
        tasks: secondary tasks, beside the tracking of the reference.
    """

    robot: Robot
    q0: Array
    v0: Array
    reference: Reference
    gain: float
    dt: float
    duration: float
    certificate: Certificate
    tasks: tuple[Task, ...] = ()

    def __post_init__(self) -> None:
        """Check that a run ends (see `steps_in`)."""
        steps_in(self.duration, self.dt)

    @cached_property
    def steps(self) -> int:
        """Number of control steps of a time-indexed run."""
        return steps_in(self.duration, self.dt)

    @cached_property
    def targets(self) -> list[tuple[Any, Any]]:
        """Placement and body twist of the reference before each step and after the last.

        Those of a time-indexed run, the same for every law: `pinocchio.SE3`, `pinocchio.Motion`.
        """
        return [self.target(k * self.dt) for k in range(self.steps + 1)]

    def target(self, tau: float) -> tuple[Any, Any]:
        """Placement and body twist of the reference at a nominal time [s]."""
        return self.reference.placement(tau), pin.Motion(self.reference.velocity(tau))

    @cached_property
    def target_arrays(self) -> tuple[Array, Array]:
        """Rotations (n + 1, 3, 3) and translations (n + 1, 3) of `targets`."""
        rotations = np.array([X.rotation for X, _ in self.targets])
        return rotations, np.array([X.translation for X, _ in self.targets])
