"""One control step as a formulation sees it, and what a formulation is."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from importlib.util import find_spec
from itertools import groupby
from operator import attrgetter
from typing import Final, Literal, Protocol, runtime_checkable

import msgspec
import numpy as np

from dikbench.arrays import Array, Indices
from dikbench.errors import DikbenchError, in_words
from dikbench.problem.tasks.task import LinearizedJointTask, LinearizedTask, stacked
from dikbench.problem.velocity_box import Box, Braking, velocity_box
from dikbench.programs.modelled_program import ModelledProgram
from dikbench.programs.quadratic_program import ProgramKind, QuadraticProgram
from dikbench.robots.limits import Limits
from dikbench.robots.robot import Robot

LimitKind = Literal["position", "velocity", "acceleration", "inequalities"]

ProblemPart = Literal["inequalities", "postures", "lower-tasks", "weights"]
"""What a formulation may see of a problem in addition to the tasks of first priority, which all do:
the rows G v <= h; joint tasks below the first priority; all tasks below it; the weights of tasks
and rows."""

_PRIORITY: Final = attrgetter("priority")


class DikProblem(msgspec.Struct, eq=False):
    """One control step: the configuration, the tasks, the limits.

    A formulation that is `batched` (see `Formulation`) is handed N control steps of one robot at
    once: q, v_prev, the coordinates of the limits, and J, V and the error of each task have an axis
    of rows in front, (N, nq), (N, m, nv) ...; a posture task's J is the same for all, (nv, nv).

    The tasks may be given in any order: they are sorted by priority when the problem is made, and
    those of one priority keep the order in which they were given.

    Attributes:
        robot: the robot; a formulation may use `robot.scratch` for its own kinematics.
        q: configuration, (nq,).
        v_prev: the velocity that the plant applied last, (nv,); None: no acceleration bound.
        dt: control period [s].
        tasks: the linearised tasks J v = V, most important first, as a tuple.
        limits: the limits in force, as seen from q.
        relaxed: joints whose acceleration bound `box` had to give up (a record, see `box`).
        G, h: constraints G v <= h in addition, (p, nv) and (p,); None without any (see
            `dikbench.problem.constraints`).
    """

    robot: Robot
    q: Array
    v_prev: Array | None
    dt: float
    tasks: Sequence[LinearizedTask]
    limits: Limits
    relaxed: int | Indices = 0
    G: Array | None = None
    h: Array | None = None
    _levels: tuple[LinearizedTask, ...] | None = None

    def __post_init__(self) -> None:
        """Check q; sort the tasks. Most are sorted, one per priority: then they are the levels.

        Raises:
            DikbenchError: if a (cos, sin) or a quaternion in q has not norm 1.
        """
        if self.q.ndim == 1:
            self.robot.check_norms(self.q, "q")
        self.tasks = self._levels = tasks = tuple(self.tasks)
        before = 0
        for task in tasks:
            if task.priority <= before:
                self.tasks, self._levels = tuple(sorted(tasks, key=_PRIORITY)), None
                break
            before = task.priority

    @property
    def levels(self) -> tuple[LinearizedTask, ...]:
        """One task per priority, most important first, equal priorities stacked: computed once."""
        if self._levels is None:
            groups = groupby(self.tasks, _PRIORITY)
            self._levels = tuple([stacked([*group]) for _, group in groups])
        return self._levels

    @property
    def primary(self) -> LinearizedTask:
        """The most important task (several of the same priority stacked into one)."""
        return self.levels[0]

    def box(self, braking: Braking = "viable", position_gain: float = 0.5) -> Box:
        """Compute the velocity box (see `velocity_box`) and record how many bounds it gave up."""
        box = velocity_box(self.limits, self.v_prev, self.dt, braking, position_gain)
        self.relaxed = box.relaxed
        return box


class Solve(Protocol):
    """The solver of a formulation: timed, counted, its answers rechecked."""

    def __call__(self, program: QuadraticProgram | ModelledProgram) -> Array:
        """Solve a program and return x.

        Raises:
            Infeasible: the program has no feasible point.
            SolverFailed: the solver gave no answer to a feasible program.
        """
        ...

    def verify(
        self,
        program: QuadraticProgram,
        x: Array,
        y: Array | None = None,
        z: Array | None = None,
        z_box: Array | None = None,
    ) -> None:
        """Hand over a program that the formulation solved itself, to be rechecked like others.

        It costs the formulation no time, and its answer counts as one that was claimed.

        Args:
            program: the program.
            x: the answer.
            y: multipliers of the equalities, where they are known (see `Answer`).
            z: those of the inequalities.
            z_box: those of the bounds.
        """
        ...


@runtime_checkable
class Formulation(Protocol):
    """A formulation of differential inverse kinematics: a frozen dataclass of parameters.

    In addition to `velocity` it may declare, as class attributes or properties, `program` (the kind
    of program it has solved; default: none), `keeps` (the limits it promises to keep; default:
    none) and `sees` (the parts of a problem that it takes into account, see `ProblemPart`; default:
    none but what it keeps). A method `refuses(problem)` says why it cannot answer problems of this
    kind, and returns an empty text where it can. A mapping `requires` says which modules it imports
    that do not come with dikbench, and the command that installs each. A paragraph `Source: ...` in
    its docstring names the paper. The same problem gives the same velocity.

    A peer, another library as a formulation, says with `computes_kinematics = True` that its call
    is a whole tick, with `counterpart` which formulation (a selector) is to answer alike, with
    `known_difference(problem, velocity)` why it did not here (an empty text: no reason is known;
    the velocity is None where it has none), and with `package` which distribution it is.

    With `batched = True` it says that `velocity` also answers N control steps at once (see
    `DikProblem`), (N, nv), each as if it were alone: matrices with the functions of
    `dikbench.problem`, everything else element by element or over the last axis. NaN in a row
    stands for an answer that it has to be asked for alone.

    With `strict = True` it promises that no task of lower priority costs the first one anything.
    """

    def velocity(self, problem: DikProblem, solve: Solve) -> Array:
        """Compute the joint velocity of this control step, (nv,) [rad/s or m/s].

        Raises:
            CannotAnswer: `Infeasible` or `SolverFailed`; the harness then applies the fallback.
        """
        ...


def program_of(formulation: Formulation) -> ProgramKind | None:
    """Return the kind of program that the formulation has a solver solve, or None."""
    program: ProgramKind | None = getattr(formulation, "program", None)
    return program


def promises_of(formulation: Formulation) -> frozenset[LimitKind]:
    """Return the kinds of limits that the formulation promises to keep."""
    return frozenset(getattr(formulation, "keeps", ()))


def computes_kinematics(formulation: Formulation) -> bool:
    """Whether the formulation computes kinematics of its own, as part of its call."""
    return bool(getattr(formulation, "computes_kinematics", False))


def is_strict(formulation: Formulation) -> bool:
    """Whether the formulation promises that lower tasks cost the first priority nothing."""
    return bool(getattr(formulation, "strict", False))


def not_installed(formulation: Formulation | type) -> str:
    """Which module that a formulation requires is not installed here; empty where none is."""
    requires: Mapping[str, str] = getattr(formulation, "requires", {})
    for module, command in requires.items():
        if find_spec(module) is None:
            return f"{module} is not installed: {command}"
    return ""


def is_batched(formulation: Formulation) -> bool:
    """Return whether the formulation answers many control steps at once.

    Raises:
        DikbenchError: if what it says of it raises, or is not true or false.
    """
    name = type(formulation).__qualname__
    try:
        batched = getattr(formulation, "batched", False)
    except Exception as error:
        raise DikbenchError(f"class {name}: batched raised {in_words(error)}") from error
    if not isinstance(batched, bool):
        raise DikbenchError(f"class {name}: batched is {batched!r}; valid: True or False")
    return batched


def sight_of(formulation: Formulation) -> frozenset[ProblemPart]:
    """What the formulation sees of a problem; the rows that it promises to keep it does."""
    seen: set[ProblemPart] = set(getattr(formulation, "sees", ()))
    if "inequalities" in promises_of(formulation):
        seen.add("inequalities")
    return frozenset(seen)


def refusal_of(formulation: Formulation, problem: DikProblem) -> str:
    """Why the formulation cannot answer problems of this kind; empty where it can.

    It is its own reason, that something is not installed, or that it does not look at the rows
    G v <= h of the problem.
    """
    if missing := not_installed(formulation):
        return missing
    if sees_constraints(formulation, problem) is False:
        return (
            "does not look at constraints (rows G v <= h, of distances and torques); leave them "
            "out, or take a formulation that sees 'inequalities'"
        )
    refuses: Callable[[DikProblem], str] | None = getattr(formulation, "refuses", None)
    return "" if refuses is None else refuses(problem)


def sees_constraints(formulation: Formulation, problem: DikProblem) -> bool | None:
    """Whether the formulation sees the rows G v <= h; None where there are none."""
    return None if problem.G is None else "inequalities" in sight_of(formulation)


def sees_lower_tasks(formulation: Formulation, problem: DikProblem) -> bool | None:
    """Whether the formulation sees every task below the first priority; None: there is none."""
    first = problem.tasks[0].priority
    lower = [task for task in problem.tasks if task.priority > first]
    if not lower:
        return None
    seen = sight_of(formulation)
    joints = all(isinstance(task, LinearizedJointTask) for task in lower)
    return "lower-tasks" in seen or (joints and "postures" in seen)


def sees_weights(formulation: Formulation, problem: DikProblem) -> bool | None:
    """Whether the formulation sees the weights; None where there are none to see.

    Those are, of the first priority, all but 1 (one number for all of it counts against a damping),
    and below it those that differ within a priority.
    """
    first, *lower = problem.levels
    if np.all(np.equal(first.weight, 1.0)) and not any(np.ptp(level.weight) for level in lower):
        return None
    return "weights" in sight_of(formulation)
