"""One control step, for interactive use."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from numbers import Real
from typing import Any, Final, Literal, get_args

import numpy as np
import pinocchio as pin

from dikbench.arrays import Array
from dikbench.errors import DikbenchError, unknown
from dikbench.plugins.building import make_formulation
from dikbench.problem.constraints import Constraint
from dikbench.problem.posing import pose_problem
from dikbench.problem.problem import (
    DikProblem,
    Formulation,
    program_of,
    refusal_of,
    sees_lower_tasks,
    sees_weights,
    sight_of,
)
from dikbench.problem.progress import STUCK_PROGRESS, progress, row_weights
from dikbench.problem.tasks import LinearizedTask, PoseTask, Task
from dikbench.problem.tasks.rows import in_task_axes
from dikbench.problem.tasks.task import check_weight
from dikbench.robots.kinematics import Kinematics
from dikbench.robots.robot import Robot, checked_vector
from dikbench.simulation.control_step import TrialEnded, control_step
from dikbench.simulation.status import Status
from dikbench.solvers.catalogue.back_ends import DEFAULT_SOLVER, parse_solver, why_not
from dikbench.solvers.checked_solve import CheckedSolve, make_solve

ReferenceFrame = Literal["LOCAL", "LOCAL_WORLD_ALIGNED", "WORLD"]
REFERENCE_FRAMES: Final = get_args(ReferenceFrame)


@dataclass(frozen=True, eq=False)
class DikAnswer:
    """The answer to one control step.

    Attributes:
        velocity: joint velocity, (nv,) [rad/s or m/s]; the fallback's where the formulation has no
            answer.
        progress: achieved share of the desired motion, <J v, V>/|V|^2 with angular rows weighted
            by L = 0.2 m (the alpha of formulations that scale); NaN where no motion is desired.
        status: how the step ended.
        relaxed: number of joints whose acceleration bound had to be given up.
    """

    velocity: Array
    progress: float
    status: Status
    relaxed: int


def solve_dik(
    robot: Robot,
    q: object,
    *,
    formulation: str | Formulation,
    twist: object = None,
    target: Any = None,
    reference_frame: ReferenceFrame | None = None,
    gain: float | None = None,
    weight: float | Sequence[float] | Array = 1.0,
    priority: int = 1,
    dt: float = 0.01,
    solver: str | None = None,
    v_prev: object = None,
    tasks: Sequence[Task] = (),
    constraints: Sequence[Constraint] = (),
) -> DikAnswer:
    """Compute the joint velocity of one control step.

    Where q is outside a position limit, formulations that keep the limits move back inside, at most
    at a tenth of the velocity limit, or the fallback does so (status `infeasible`).

    Args:
        robot: the robot, with the limits that are in force.
        q: configuration, (nq,).
        formulation: a formulation or its selector, such as `dls[damping=0.1]`.
        twist: desired twist of the task frame, (linear; angular), (6,) [m/s; rad/s].
        target: desired placement of the task frame (`pinocchio.SE3`); give this or a twist.
        reference_frame: the axes in which the twist is given, Pinocchio's names; default: LOCAL.
        gain: gain on the target's error [1/s]; default: 1/dt, which reaches it in one step.
        weight: weight of the twist or target where tasks compete, one number or one per row of
            `Robot.task_rows`; any but 1 needs a formulation that sees `weights`.
        priority: its priority; 1 is the most important.
        dt: control period [s].
        solver: a solver's selector, such as `osqp[eps_abs=1e-6]`; default: daqp[then=clarabel],
            or clarabel for a formulation written in cvxpy. Not used by formulations that need none.
        v_prev: velocity applied in the previous step, (nv,); None: no acceleration bound.
        tasks: other tasks, in any order, of any priority (those below the first are secondary,
            and need a formulation that sees them).
        constraints: conditions in addition to the joint limits.

    Raises:
        DikbenchError: on a wrong name, shape or value, or a formulation that refuses such a
            problem, does not look at some of it, raises an error or returns a wrong shape or NaN.
    """
    if not isinstance(robot, Robot):
        raise DikbenchError(
            f"robot: expected a Robot (dikbench.load_robot), got {type(robot).__name__}"
        )
    if isinstance(formulation, str):
        formulation = make_formulation(formulation)
    if not isinstance(formulation, Formulation):
        raise DikbenchError(
            f"formulation: expected a formulation or its selector, got {formulation!r}"
        )
    _check_positive("dt", dt)
    if reference_frame not in (None, *REFERENCE_FRAMES):
        raise unknown("reference_frame", reference_frame, REFERENCE_FRAMES)
    configuration = robot.configuration(q)
    previous = None if v_prev is None else checked_vector(v_prev, robot.nv, "v_prev")
    _check_tasks(tasks)
    if solver is not None and not isinstance(solver, str):
        raise DikbenchError(f"solver: expected a selector such as 'daqp', got {solver!r}")
    kinematics = Kinematics(robot)
    kinematics.update(configuration)
    if (twist is None) == (target is None):
        raise DikbenchError("give either a twist or a target")
    if target is None:
        if gain is not None:
            raise DikbenchError("gain: belongs to a target; a twist has none")
        main = _twist_task(kinematics, twist, reference_frame)
    else:
        if reference_frame is not None:
            raise DikbenchError("reference_frame: belongs to a twist; a target is in the world")
        main = _target_task(kinematics, target, 1 / dt if gain is None else gain)
    _rank("twist" if target is None else "target", main, weight, priority)
    problem = pose_problem(kinematics, previous, dt, main, tasks, constraints)
    reason = refusal_of(formulation, problem) or _unseen(formulation, problem)
    if reason:
        raise DikbenchError(f"formulation {type(formulation).__name__}: {reason}")
    solve = _solve_for(formulation, solver)
    try:
        answer = control_step(formulation, problem, solve)
    except TrialEnded as ended:
        raise DikbenchError(f"{ended.status.value}: {ended}") from ended
    v = answer.velocity
    alpha = float(progress(main.V[None], (main.J @ v)[None], row_weights(robot.task_rows))[0])
    status = answer.status
    if status is Status.OK and solve.rechecked().lied[0]:
        status = Status.NOT_VERIFIED
    if status is Status.OK and alpha < STUCK_PROGRESS:
        status = Status.STUCK
    return DikAnswer(v, alpha, status, int(problem.relaxed))


def _solve_for(formulation: Formulation, selector: str | None) -> CheckedSolve:
    program = program_of(formulation)
    if program is None:
        if selector is not None:
            parse_solver(selector)  # a wrong name is an error even where no solver is needed
        return make_solve(None, None)
    solver = parse_solver(DEFAULT_SOLVER[program] if selector is None else selector)
    reason = why_not(solver, program)
    if reason:
        raise DikbenchError(reason)
    return make_solve(solver, program)


def _rank(what: str, task: LinearizedTask, weight: Any, priority: object) -> None:
    """Give the main task its weight and its priority."""
    check_weight(what, weight, len(task.V))
    if not isinstance(priority, int) or priority < 1:
        raise DikbenchError(f"priority: expected 1 (the most important), 2, ..., got {priority!r}")
    task.weight = float(weight) if np.ndim(weight) == 0 else np.array(weight, dtype=float)
    task.priority = priority


def _unseen(formulation: Formulation, problem: DikProblem) -> str:
    """Why some of what is given would be ignored; empty where nothing is."""
    if sees_lower_tasks(formulation, problem) is False:
        but = "but postures " if "postures" in sight_of(formulation) else ""
        return (
            f"does not look at tasks {but}below the first priority, such as one of priority "
            f"{problem.tasks[-1].priority}; leave them out, or take a formulation that sees "
            "'lower-tasks'"
        )
    if sees_weights(formulation, problem) is False:
        return (
            "does not look at weights; leave those of the first priority at 1 and those of a lower "
            "one equal, or take a formulation that sees 'weights'"
        )
    return ""


def _check_positive(name: str, value: object) -> None:
    if not isinstance(value, Real) or not 0 < float(value) < float("inf"):
        raise DikbenchError(f"{name}: expected a positive finite number, got {value!r}")


def _check_tasks(tasks: object) -> None:
    if not isinstance(tasks, Sequence) or not all(hasattr(task, "linearize") for task in tasks):
        raise DikbenchError(
            "tasks: expected a list of tasks, such as [dikbench.PostureTask(target=robot.q0)]"
        )


def _twist_task(
    kinematics: Kinematics, twist: object, reference_frame: str | None
) -> LinearizedTask:
    """Make the task J v = V of a twist that is given in the axes of a reference frame."""
    robot = kinematics.robot
    V = checked_vector(twist, 6, "twist")
    X = kinematics.placement(robot.frame_id)
    if reference_frame == "LOCAL_WORLD_ALIGNED":
        V = np.concatenate([X.rotation.T @ V[:3], X.rotation.T @ V[3:]])
    elif reference_frame == "WORLD":
        V = X.toActionMatrixInverse() @ V
    rows = np.array(robot.task_rows)
    V = np.concatenate([in_task_axes(robot, X.rotation, part) for part in (V[:3], V[3:])])
    return LinearizedTask(kinematics.task_jacobian(), V[rows], np.zeros(len(rows)))


def _target_task(kinematics: Kinematics, target: Any, gain: float) -> LinearizedTask:
    if not isinstance(target, pin.SE3):
        raise DikbenchError(f"target: expected a pinocchio.SE3, got {type(target).__name__}")
    if not np.isfinite(target.homogeneous).all():
        raise DikbenchError("target: expected finite numbers")
    _check_positive("gain", gain)
    return PoseTask(target=target, gain=gain).linearize(kinematics)
