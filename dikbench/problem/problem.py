"""One control step as a law sees it, and what a law is."""

from __future__ import annotations

from typing import Literal, Protocol, runtime_checkable

import msgspec

from dikbench.arrays import Array
from dikbench.problem.tasks.task import LinearizedTask, stacked
from dikbench.problem.velocity_box import Box, Braking, velocity_box
from dikbench.programs.modelled_program import ModelledProgram
from dikbench.programs.quadratic_program import Program, QuadraticProgram
from dikbench.robots.limits import Limits
from dikbench.robots.robot import Robot

LimitKind = Literal["position", "velocity", "acceleration", "inequalities"]


class DikProblem(msgspec.Struct, eq=False):
    """One control step: where the robot is, what is wanted of it, what it may do.

    Attributes:
        robot: the robot; `robot.scratch` is free for a law's own kinematics.
        q: configuration, (nq,).
        v_prev: the velocity that the plant applied last, (nv,); None: no acceleration bound.
        dt: control period [s].
        tasks: the linearised tasks J v = V, most important first.
        limits: the limits in force, as seen from q.
        relaxed: joints whose acceleration bound `box` had to give up (a record, see `box`).
        G, h: what else must hold, G v <= h, (p, nv) and (p,); None where nothing else must (see
            `dikbench.problem.constraints`).
    """

    robot: Robot
    q: Array
    v_prev: Array | None
    dt: float
    tasks: list[LinearizedTask]
    limits: Limits
    relaxed: int = 0
    G: Array | None = None
    h: Array | None = None

    @property
    def primary(self) -> LinearizedTask:
        """The most important task (several of the same priority stacked into one)."""
        first = self.tasks[0]
        if len(self.tasks) == 1 or self.tasks[1].priority != first.priority:
            return first
        return stacked([task for task in self.tasks if task.priority == first.priority])

    @property
    def levels(self) -> list[LinearizedTask]:
        """One task per priority, most important first, equal priorities stacked."""
        priorities = sorted({task.priority for task in self.tasks})
        return [stacked([t for t in self.tasks if t.priority == p]) for p in priorities]

    def box(self, braking: Braking = "viable", position_gain: float = 0.5) -> Box:
        """The velocity box (see `velocity_box`); how many bounds it gave up is recorded here."""
        box = velocity_box(self.limits, self.v_prev, self.dt, braking, position_gain)
        self.relaxed = box.relaxed
        return box


class Solve(Protocol):
    """A solver, injected into a law: timed, counted, its answers rechecked."""

    def __call__(self, program: QuadraticProgram | ModelledProgram) -> Array:
        """Solve a program and return x.

        Raises:
            Infeasible: the program has no feasible point.
            SolverFailed: the solver gave no answer although there is one.
        """
        ...


@runtime_checkable
class Formulation(Protocol):
    """A law of differential inverse kinematics: a frozen dataclass whose fields are parameters.

    Besides `velocity` it may declare, as class attributes or properties, `program` (what it needs
    a solver for; default: none) and `keeps` (the limits it promises to keep; default: none); a
    paragraph `Source: ...` in its docstring names the paper. The same problem gives the same
    velocity.
    """

    def velocity(self, problem: DikProblem, solve: Solve) -> Array:
        """The joint velocity of this control step, (nv,) [rad/s or m/s].

        Raises:
            CannotAnswer: as `Infeasible` or `SolverFailed`; the harness applies the fallback.
        """
        ...


def program_of(formulation: Formulation) -> Program | None:
    """What the law needs a solver for; None for a law that needs none."""
    program: Program | None = getattr(formulation, "program", None)
    return program


def promises_of(formulation: Formulation) -> frozenset[LimitKind]:
    """The kinds of limits that the law promises to keep."""
    return frozenset(getattr(formulation, "keeps", ()))
