"""Makers of control steps, and of what a formulation answers."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import Any

import numpy as np
import pinocchio as pin

from dikbench.arrays import Array
from dikbench.plugins.building import make_formulation
from dikbench.problem import (
    DikProblem,
    Formulation,
    Interval,
    Kinematics,
    Limits,
    LinearizedTask,
    Robot,
    program_of,
)
from dikbench.problem.tasks import PositionTask, PostureTask
from dikbench.programs.quadratic_program import QuadraticProgram
from dikbench.robots.limits import JointLimits
from dikbench.robots.loading import load_robot
from dikbench.robots.planar_arm import planar_arm
from dikbench.robots.robot import model_limits
from dikbench.solvers.catalogue.back_ends import parse_solver
from dikbench.solvers.checked_solve import CheckedSolve, make_solve


def planar_robot(*lengths: float, velocity: float) -> Robot:
    """Make a planar arm of links [m] whose task is its tip, limited in velocity [rad/s]."""
    model = planar_arm(lengths, velocity_limits=(velocity,) * len(lengths))
    q0 = np.zeros(len(lengths))
    limits = model_limits(model)
    return Robot(f"planar{len(lengths)}r", model, "tip", limits, q0, (0, 1), movable_rows=(0, 1))


def with_limits_in_force(name: str, kinds: str) -> Robot:
    """Load a robot with position limits (q), velocity limits (v), both or none in force."""
    robot = load_robot(name)
    if "q" not in kinds:
        robot = robot.with_limits(position=None)
    return robot if "v" in kinds else robot.with_limits(velocity=None)


def with_upper_limit(name: str, joint: int, upper: float) -> Robot:
    """Load a robot and give one of its joints another upper position limit [rad]."""
    robot = load_robot(name)
    position = robot.limits.position
    assert position is not None
    highest = position.upper.copy()
    highest[joint] = upper
    return robot.with_limits(position=(position.lower, highest))


def kinematics_at(robot: Robot, q: Array) -> Kinematics:
    """Make the kinematics of a robot at a configuration (nq,)."""
    kinematics = Kinematics(robot)
    kinematics.update(q)
    return kinematics


def task_jacobian(robot: Robot, q: Array) -> Array:
    """Compute the task Jacobian, in the rows that the robot can move, by Pinocchio alone."""
    J: Array = pin.computeFrameJacobian(
        robot.model, robot.model.createData(), q, robot.frame_id, pin.LOCAL
    )
    return J[list(robot.task_rows)]


def equation(J: Array, V: Array, priority: int = 1) -> LinearizedTask:
    """Make a task J v = V in numbers, without an error."""
    return LinearizedTask(J, V, np.zeros(len(V)), 1.0, priority)


def equations(*tasks: tuple[Array, Array]) -> list[LinearizedTask]:
    """Make tasks J v = V in numbers, one for each priority."""
    return [equation(J, V, priority) for priority, (J, V) in enumerate(tasks, start=1)]


def problem_at(
    robot: Robot,
    q: Array,
    tasks: Sequence[LinearizedTask],
    v_prev: Array | None = None,
    dt: float = 0.01,
) -> DikProblem:
    """Make a control step at a configuration (nq,), by default without a motion before."""
    return DikProblem(robot, q, v_prev, dt, tasks, robot.limits.at(q))


def problem_of(*tasks: LinearizedTask, robot: str | Robot = "planar3r") -> DikProblem:
    """Make a control step at the start of a robot with tasks given in numbers.

    For formulations that look at nothing else: J may be of another size than the robot.
    """
    arm = load_robot(robot) if isinstance(robot, str) else robot
    return problem_at(arm, arm.q0, tasks)


def solve_for(formulation: Formulation, solver: str = "daqp") -> CheckedSolve:
    """Make the solve of a formulation, with a solver where it needs one."""
    program = program_of(formulation)
    return make_solve(None if program is None else parse_solver(solver), program)


def velocity_of(formulation: str | Formulation, problem: DikProblem, solver: str = "daqp") -> Array:
    """Ask a formulation for its velocity; it may raise `CannotAnswer`."""
    law = make_formulation(formulation) if isinstance(formulation, str) else formulation
    solve = solve_for(law, solver)
    solve.begin_step(0)
    return law.velocity(problem, solve)


class KeepsProgram:
    """A solve that keeps the program it is given."""

    def __init__(self, solver: str = "daqp") -> None:
        self.solve = make_solve(parse_solver(solver), "qp")
        self.program: QuadraticProgram | None = None

    def __call__(self, program: Any) -> Array:
        """See `Solve`."""
        self.program = program
        return self.solve(program)

    def verify(self, program: QuadraticProgram, x: Array, *multipliers: Array | None) -> None:
        """See `Solve`."""
        self.solve.verify(program, x, *multipliers)


def limits_at_distances(
    to_lower: object,
    to_upper: object,
    *,
    velocity: object = None,
    acceleration: object = None,
) -> Limits:
    """Make limits of joints whose distances to their position limits are given, (nv,)."""
    below, above = (np.atleast_1d(np.asarray(d, float)) for d in (to_lower, to_upper))
    n = len(below)
    joint = JointLimits(
        nv=n,
        q_index=np.arange(n),
        position=Interval(-below, above),
        velocity=interval_of(velocity, n),
        acceleration=interval_of(acceleration, n),
        effort=None,
    )
    return joint.at(np.zeros(n))


def interval_of(value: object, n: int) -> Interval | None:
    """Make an interval of a pair (lower, upper), a symmetric magnitude, or None."""
    if value is None:
        return None
    lower, upper = value if isinstance(value, tuple) else (-np.asarray(value), value)
    return Interval(*(np.broadcast_to(np.asarray(side, float), (n,)) for side in (lower, upper)))


def random_step(
    robot: Robot, random: np.random.Generator, speed: float, *, second: str = "posture"
) -> DikProblem:
    """A random state near the robot's start with a random twist and a second task."""
    q = pin.integrate(robot.model, robot.q0, random.uniform(-0.4, 0.4, robot.nv))
    kinematics = kinematics_at(robot, q)
    tasks = [equation(kinematics.jacobian(robot.frame_id), speed * random.normal(size=6))]
    if second == "posture":
        target = pin.integrate(robot.model, q, random.uniform(-0.3, 0.3, robot.nv))
        tasks.append(PostureTask(target=target).linearize(kinematics))
    elif second == "elbow":
        X = kinematics.placement(robot.model.getFrameId("panda_link4"))
        point = X.translation + random.uniform(-0.2, 0.2, 3)
        elbow = PositionTask(target=point, frame="panda_link4", priority=2)
        tasks.append(elbow.linearize(kinematics))
    return problem_at(robot, q, tasks)


def random_steps(count: int, speed: float, second: str = "posture") -> Iterator[DikProblem]:
    """Random states of a Panda (see `random_step`), always the same ones."""
    robot, random = load_robot("panda"), np.random.default_rng(0)
    for _ in range(count):
        yield random_step(robot, random, speed, second=second)
