"""Posing: the only place where the harness makes a `DikProblem`."""

from __future__ import annotations

from collections.abc import Sequence

from dikbench.arrays import Array
from dikbench.problem.constraints import Constraint, linearize_all
from dikbench.problem.problem import DikProblem
from dikbench.problem.tasks.task import LinearizedTask, Task
from dikbench.robots.kinematics import Kinematics


def pose_problem(
    kinematics: Kinematics,
    v_prev: Array | None,
    dt: float,
    tracking: LinearizedTask,
    tasks: Sequence[Task] = (),
    constraints: Sequence[Constraint] = (),
) -> DikProblem:
    """Pose the problem of one control step at the configuration of `kinematics`.

    Args:
        kinematics: the robot at the configuration q at which everything is linearised.
        v_prev: the velocity that the plant applied last, (nv,) [rad/s or m/s], or None.
        dt: control period [s].
        tracking: the task J v = V of the end-effector frame, the first of its priority.
        tasks: the other tasks, in any order (see `DikProblem`).
        constraints: conditions in addition to the joint limits.

    Raises:
        DikbenchError: if a task or a constraint does not fit the robot.
    """
    robot, q = kinematics.robot, kinematics.q
    linearized = [tracking]
    for task in tasks:
        linearized.append(task.linearize(kinematics))
    G, h = linearize_all(constraints, kinematics, v_prev, dt)
    return DikProblem(robot, q, v_prev, dt, linearized, robot.limits.at(q), 0, G, h)
