"""A scenario family: a frozen dataclass whose fields are the parameters of its scenarios."""

from __future__ import annotations

from abc import ABC, abstractmethod
from dataclasses import dataclass
from typing import Annotated, Any, ClassVar

import numpy as np
import pinocchio as pin

from dikbench.arrays import Array
from dikbench.errors import DikbenchError
from dikbench.parameters import Parameters, Range, parameters_of
from dikbench.problem.constraints import Constraint
from dikbench.problem.tasks import PoseTask, Task, TrackingTask, TrackingTogether
from dikbench.robots.catalogue import load_robot
from dikbench.robots.robot import Robot
from dikbench.scenario.building import (
    limits_in_force,
    samples,
    secondary_tasks,
    start_velocity,
)
from dikbench.scenario.certificate import Certificate, Claim
from dikbench.scenario.oracle import POSE, OracleMotion, oracle_motion
from dikbench.scenario.reference.reference import Reference
from dikbench.scenario.scenario import Scenario, first_level
from dikbench.scenario.variation import NO_VARIATION, Perturbation, Variation

Gain = Annotated[float, Range(above=0.0, unit="1/s")]
"""The gain of a task, the desired velocity per error."""

Time = Annotated[float, Range(above=0.0, unit="s")]
"""A control period or a duration."""


@dataclass(frozen=True, eq=False)
class Case:
    """The part of a scenario that its family makes; `Family.scenario` fills in what is None.

    Attributes:
        reference: the desired motion of the task frame.
        q0: configuration at the start, (nq,).
        motion: the joint motion that follows the reference exactly; None where there is none.
        claims: the claims of its certificate.
        robot: the robot with its limits in force; default: the one that the case was made with.
        tracking: the task that follows the reference; default: the whole pose.
        v0: joint velocity at the start, (nv,) [rad/s or m/s]; default: the reference's own.
        tasks: other tasks; default: hold the posture q0 in the null space, where there is one.
        duration: length of a time-indexed run [s]; default: the reference's.
        constraints: conditions in addition to the joint limits.
    """

    reference: Reference
    q0: Array
    motion: OracleMotion | None
    claims: tuple[Claim, ...]
    robot: Robot | None = None
    tracking: TrackingTask | None = None
    v0: Array | None = None
    tasks: tuple[Task, ...] | None = None
    duration: float | None = None
    constraints: tuple[Constraint, ...] = ()


@dataclass(frozen=True, kw_only=True)
class Family(Parameters, ABC):
    """Scenarios that differ in parameters; a subclass adds parameters and defines `case`.

    A field to which a subclass gives one value only (`frame: None = None`) is fixed and hidden. The
    paragraphs `Provokes: ...`, `Shows in: ...` and `Source: ...` of the docstring are shown in
    lists.

    Attributes:
        robot: a robot's name, or the path of a URDF.
        frame: the task frame; default: the robot's.
        gain: gain of the tracking task.
        dt: control period.
        acceleration: whether acceleration limits are in force.
        robots: robots on which the defaults are certified, where the family takes any robot.
        variation: the ranges of what a seed perturbs.
        grid: the two parameters of a phase diagram, horizontal and vertical.
        about_position_limits: whether figures show the distance to the position limits.
    """

    robot: str = "panda"
    frame: str | None = None
    gain: Gain = 5.0
    dt: Time = 0.01
    acceleration: bool = False

    robots: ClassVar[tuple[str, ...]] = ()
    variation: ClassVar[Variation] = NO_VARIATION
    grid: ClassVar[tuple[str, str] | None] = None
    about_position_limits: ClassVar[bool] = False

    def __init_subclass__(cls, **options: Any) -> None:
        """Refuse class variables of another kind than figures, checks and seeds need.

        Raises:
            DikbenchError: if there is one.
        """
        super().__init_subclass__(**options)
        wanted: dict[str, tuple[bool, str]] = {
            "variation": (isinstance(cls.variation, Variation), "Variation(start=0.1)"),
            "robots": (_names(cls.robots), '("panda", "ur5")'),
            "grid": (cls.grid is None or (_names(cls.grid) and len(cls.grid) == 2), '("x", "y")'),
        }
        for name, (fits, example) in wanted.items():
            if not fits:
                raise DikbenchError(
                    f"class {cls.__qualname__}: {name} = {getattr(cls, name)!r} is not valid; "
                    f"valid: such as {name} = {example}"
                )

    @abstractmethod
    def case(self, robot: Robot, change: Perturbation) -> Case:
        """Make the family's part of a scenario.

        Args:
            robot: the robot that `robot` and `frame` name, with its limits in force.
            change: the perturbation by the seed.

        Raises:
            DikbenchError: if there is no such case; the caller adds the family's name.
        """

    def scenario(self, seed: int = 0) -> Scenario:
        """Make the scenario of a seed and check its certificate.

        Raises:
            DikbenchError: if there is none with these parameters.
            CertificateFailed: if a claim does not hold.
        """
        change = self.variation.drawn(seed)
        arm = limits_in_force(load_robot(self.robot, self.frame), acceleration=self.acceleration)
        case = self.case(arm, change)
        _check_case(case)
        robot = arm if case.robot is None else case.robot
        tracking, tasks, v0 = case.tracking, case.tasks, case.v0
        if tracking is None:
            tracking = PoseTask(gain=self.gain)
        if tasks is None:
            tasks = secondary_tasks(robot, case.q0, tracking)
        if v0 is None:
            v0 = start_velocity(robot, case.reference, case.q0, first_level(tracking, tasks))
        made = Scenario(
            robot=robot,
            q0=case.q0,
            v0=v0,
            reference=case.reference,
            tracking=tracking,
            dt=self.dt,
            duration=case.reference.duration if case.duration is None else case.duration,
            certificate=Certificate(case.claims),
            tasks=tasks,
            motion=case.motion,
            variation=self.variation,
            constraints=case.constraints,
        )
        made.certificate.check(type(self).__name__)
        return made

    def exact_motion(
        self,
        robot: Robot,
        reference: Reference,
        q0: Array,
        tracking: TrackingTask = POSE,
        most: int = 200,
    ) -> OracleMotion:
        """Follow a reference exactly from q0 (nq,), at every control step, or `most` of them.

        Raises:
            DikbenchError: if a sample cannot be reached.
        """
        instants = samples(reference.duration, self.dt, most)
        return oracle_motion(robot, reference, q0, instants, tracking)


def _names(value: object) -> bool:
    return isinstance(value, tuple) and all(isinstance(name, str) for name in value)


def _check_case(case: object) -> None:
    """Check what a family's `case` returned, where a run would end in words of Python or NumPy."""
    if not isinstance(case, Case):
        raise DikbenchError(
            f"case() returned {type(case).__name__}; valid: a dikbench.scenario.Case"
        )
    if isinstance(case.tracking, TrackingTogether):
        raise DikbenchError(
            "case() returned a TrackingTogether as `tracking`; valid: a task of the task frame "
            "alone, such as PoseTask, and the others of its priority in `tasks`"
        )
    placement, twist = case.reference.placement(0.0), case.reference.velocity(0.0)
    if not isinstance(placement, pin.SE3):
        raise DikbenchError(
            f"reference.placement(0) is of type {type(placement).__name__}; valid: pinocchio.SE3"
        )
    if np.shape(twist) != (6,):
        raise DikbenchError(
            f"reference.velocity(0) has the shape {np.shape(twist)}; valid: a body twist (6,)"
        )
    for tau in (0.0, case.reference.duration):
        pose, twist = case.reference.placement(tau).homogeneous, case.reference.velocity(tau)
        if not (np.isfinite(pose).all() and np.isfinite(twist).all()):
            raise DikbenchError(f"the reference is not finite at {tau:.4g} s")


def certified_robots(family: type[Family]) -> tuple[str, ...]:
    """Return the robots on which a family's defaults are certified: those of its type, if any."""
    return parameters_of(family)["robot"].choices or family.robots
