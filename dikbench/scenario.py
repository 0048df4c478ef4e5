"""A scenario: a robot, a start, a reference motion, limits in force, and a certificate."""

from __future__ import annotations

from dataclasses import dataclass

from dikbench.array import Array
from dikbench.certificate import Certificate
from dikbench.errors import DikbenchError
from dikbench.references import Reference
from dikbench.robot import Robot
from dikbench.tasks.task import Task

MOST_STEPS = 1_000_000


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
        """Check that a run is of a size that ends.

        Raises:
            DikbenchError: if it is not.
        """
        if not 1 <= self.duration / self.dt <= MOST_STEPS:
            raise DikbenchError(
                f"a run of {self.duration:g} s at dt = {self.dt:g} s has "
                f"{self.duration / self.dt:.3g} steps; valid: 1 to {MOST_STEPS}"
            )

    @property
    def steps(self) -> int:
        """Number of control steps of a time-indexed run."""
        return max(1, round(self.duration / self.dt))
