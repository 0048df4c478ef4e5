"""A scenario family: a frozen dataclass whose fields are the parameters of its scenarios."""

from __future__ import annotations

from abc import ABC, abstractmethod
from dataclasses import dataclass, replace
from typing import Annotated, Any, ClassVar, Final

import numpy as np
import pinocchio as pin

from dikbench.arrays import Array
from dikbench.errors import DikbenchError
from dikbench.parameters import Parameters, Range, parameters_of
from dikbench.problem.constraints import Constraint
from dikbench.problem.embedding import embedding_of
from dikbench.problem.progress import CHARACTERISTIC_LENGTH_M
from dikbench.problem.tasks import PoseTask, Task, TrackingTask, TrackingTogether
from dikbench.robots.catalogue import ROBOTS
from dikbench.robots.loading import load_robot
from dikbench.robots.robot import Robot
from dikbench.robots.urdf import Root
from dikbench.scenario.building import (
    acceleration_asked,
    check_rows,
    limits_in_force,
    samples,
    secondary_tasks,
    start_velocity,
)
from dikbench.scenario.certificate import Certificate, Claim
from dikbench.scenario.infeasible import infeasible_because
from dikbench.scenario.oracle import POSE, OracleMotion, oracle_motion, position_margin
from dikbench.scenario.reference.reference import Reference
from dikbench.scenario.scenario import Judged, Scenario, first_level
from dikbench.scenario.situation import Situation, situation_of
from dikbench.scenario.tolerance import sampling_floor, tolerance_above
from dikbench.scenario.variation import NO_VARIATION, Perturbation, Variation
from dikbench.scenario.witness import (
    Feasible,
    Witness,
    beyond,
    does_the_task,
    followable,
    witness_of,
)

RETURN_TIME_CONSTANTS: Final = 5.0
"""Time constants 1/gain of the tracking task for which a time-indexed run goes on with the target
at rest at its end: an error falls to less than a hundredth."""

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
        constraints: conditions in addition to the joint limits.
        witness: a joint motion that does the task and keeps limits and distances where `motion`
            does not.
        followable_until, comes_back: see `Scenario`; default: those of `motion`, from end to end
            where there is none.
        situation: what is difficult about it; default: what its motion says (`situation_of`).
    """

    reference: Reference
    q0: Array
    motion: OracleMotion | None
    claims: tuple[Claim, ...]
    robot: Robot | None = None
    tracking: TrackingTask | None = None
    v0: Array | None = None
    tasks: tuple[Task, ...] | None = None
    constraints: tuple[Constraint, ...] = ()
    witness: OracleMotion | None = None
    followable_until: float | None = None
    comes_back: bool = True
    situation: Situation | None = None


@dataclass(frozen=True, kw_only=True)
class Family(Parameters, ABC):
    """Scenarios that differ in parameters; a subclass adds parameters and defines `case`.

    A field to which a subclass gives one value only (`frame: None = None`) is fixed and hidden. The
    paragraphs `Provokes: ...`, `Shows in: ...` and `Source: ...` of the docstring are shown in
    lists.

    Attributes:
        robot: a robot's name, or the path of a URDF.
        frame: the task frame; default: the robot's.
        rows: the rows of the frame's twist that are asked for, such as xyz for its position alone
            (see `load_robot`); default: all that the robot can move.
        lock: joints that do not move, separated by spaces, with or without positions
            (`finger=0.02`).
        root: what is between the world and a URDF's root link.
        velocity: velocity limits [rad/s or m/s], one for all joints or one for each, separated by
            spaces; default: the robot's.
        gain: gain of the tracking task.
        dt: control period.
        acceleration: whether acceleration limits are in force, or which [rad/s^2 or m/s^2], one for
            all joints or one for each, separated by spaces.
        characteristic_length: at which a turn counts as a way (see `Scenario`).
        robots: robots on which the defaults are certified, where the family takes any robot.
        variation: the ranges of what a seed perturbs.
        grid: the two parameters of a phase diagram, horizontal and vertical.
        about_position_limits: whether figures show the distance to the position limits.
        tolerance_m, judged, longest_path_run: see `Scenario`.
        outruns_sampling: whether speeds raise the tolerance (see `dikbench.scenario.tolerance`).
    """

    robot: str = "panda"
    frame: str | None = None
    rows: str | None = None
    lock: str | None = None
    root: Root = "fixed"
    velocity: float | str | None = None
    gain: Gain = 5.0
    dt: Time = 0.01
    acceleration: bool | float | str = False
    characteristic_length: Annotated[float, Range(above=0.0, unit="m")] = CHARACTERISTIC_LENGTH_M

    robots: ClassVar[tuple[str, ...]] = ()
    variation: ClassVar[Variation] = NO_VARIATION
    grid: ClassVar[tuple[str, str] | None] = None
    about_position_limits: ClassVar[bool] = False
    tolerance_m: ClassVar[float] = 0.005
    outruns_sampling: ClassVar[bool] = False
    judged: ClassVar[Judged] = "path"
    longest_path_run: ClassVar[float] = 5.0

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
        case = self.case(arm := self._arm(), change)
        _check_case(case)
        robot = arm if case.robot is None else case.robot
        tracking, tasks, v0 = case.tracking, case.tasks, case.v0
        if tracking is None:
            tracking = PoseTask(gain=self.gain)
        if tasks is None:
            tasks = secondary_tasks(robot, case.q0, tracking)
        if v0 is None:
            v0 = start_velocity(robot, case.reference, case.q0, first_level(tracking, tasks))
        witness = _first_witness(case, robot, tracking, v0, self.characteristic_length)
        feasible, duration = _feasible(case.reference, witness), case.reference.duration
        until, comes_back = case.followable_until, case.comes_back
        if witness is None and case.motion is not None:
            left = beyond(robot, case.motion, case.constraints, duration)
            until, comes_back = followable(case.motion.instants, left)
        moving = case.reference.moving
        situation = case.situation or situation_of(
            case.motion, case.constraints, position_margin(robot, case.q0), moving=moving
        )
        if moving:
            # It rests at its end for as long as it takes to see who is late and who comes back.
            duration += RETURN_TIME_CONSTANTS / self.gain + _lateness(case.motion, witness)
        made = Scenario(
            robot=robot,
            q0=case.q0,
            v0=v0,
            reference=case.reference,
            tracking=tracking,
            dt=self.dt,
            duration=duration,
            certificate=Certificate(case.claims),
            tasks=tasks,
            motion=case.motion,
            variation=self.variation,
            constraints=case.constraints,
            tolerance_m=self.tolerance_m,
            judged=self.judged,
            longest_path_run=self.longest_path_run,
            feasible=feasible,
            witness=witness,
            followable_until=until,
            comes_back=comes_back,
            situation=situation,
            characteristic_length=self.characteristic_length,
        )
        made.certificate.check(type(self).__name__)
        if self.outruns_sampling:
            tolerance = tolerance_above(sampling_floor(made), self.tolerance_m)
            if tolerance > self.tolerance_m:
                made = replace(made, tolerance_m=tolerance)
        if made.feasible == "unknown" and (reason := infeasible_because(made)):
            return replace(made, feasible="no", infeasible_because=reason)
        return made

    @property
    def as_catalogued(self) -> bool:
        """Whether the robot is in the catalogue, with its frame, rows and joints as they are there.

        Only then postures and directions that are known for its name are its own.
        """
        return self.robot in ROBOTS and self.frame is None and self.rows is None and not self.lock

    def _arm(self) -> Robot:
        """Load the robot, with its limits in force.

        Raises:
            DikbenchError: if there is none, or its joints cannot move the rows that are asked for.
        """
        in_force, by_hand = acceleration_asked(self.acceleration)
        arm = load_robot(
            self.robot,
            self.frame,
            rows=self.rows,
            lock=self.lock,
            root=self.root,
            velocity=self.velocity,
            acceleration=by_hand,
        )
        if self.robot not in ROBOTS:
            check_rows(arm)
        return limits_in_force(arm, acceleration=in_force)

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


def _first_witness(
    case: Case, robot: Robot, tracking: TrackingTask, v0: Array, length: float
) -> Witness | None:
    """Return the first of a case's joint motions that is a witness; None where none is."""
    reference = case.reference
    embedding = embedding_of(tracking, robot, reference.placement(0.0).rotation, length)
    for motion in (case.motion, case.witness):
        if motion is not None and does_the_task(robot, motion, reference, embedding):
            witness = witness_of(robot, motion, case.constraints, v0, reference.duration)
            if witness is not None:
                return witness
    return None


def _feasible(reference: Reference, witness: Witness | None) -> Feasible:
    """Say what a witness shows of a reference."""
    if witness is None:
        return "unknown"
    if reference.moving:
        return "time" if witness.by_clock else "path"
    there = float(witness.motion.instants[-1]) + witness.lateness
    return "time" if there <= reference.duration else "unknown"


def _lateness(motion: OracleMotion | None, witness: Witness | None) -> float:
    """Compute how late [s] the slowed motion is, or the exact one within its speed limits."""
    if witness is not None:
        return witness.lateness
    if motion is None:
        return 0.0
    return float((np.diff(motion.instants) * np.maximum(motion.speed_ratio - 1, 0.0)).sum())


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
