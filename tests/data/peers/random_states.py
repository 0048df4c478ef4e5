"""Ask Drake, Pink and mink on hundreds of random states and write their answers down.

    pip install -e ".[peers,drake]"
    python tests/data/peers/random_states.py      # writes random_states.npz beside this file

The same states in every run; what the arrays hold is said in the README beside this file.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

import mink
import mujoco
import numpy as np
import pink
import pinocchio as pin
from pydrake.common.value import Value
from pydrake.multibody.inverse_kinematics import (
    DifferentialInverseKinematicsParameters,
    DifferentialInverseKinematicsSystem,
    DoDifferentialInverseKinematics,
)
from pydrake.multibody.math import SpatialVelocity
from pydrake.planning import (
    DofMask,
    JointLimits,
    RobotDiagramBuilder,
    SceneGraphCollisionChecker,
)
from pydrake.systems.framework import BusValue

from dikbench import Robot, load_robot
from dikbench.arrays import Array
from dikbench.robots.kinematics import Kinematics
from formulations.peers.models import TOOL, position_limits, urdf_of

HERE = Path(__file__).parent
DT = 0.01
STATES = 110
"""Of each arm."""
GAINS = (0, 1, 10)
POSTURE_COST = 1e-2
ARMS = ("panda", "ur5", "ur10", "xarm7")


def states(robot: Robot, random: np.random.Generator) -> tuple[Array, Array, Array]:
    """Configurations, velocities before, wanted body twists (linear; angular).

    A third of them 1 mrad inside a limit of one joint; half at rest with any twist, half in motion,
    asked for 0.8 to 1.5 times the twist that they have.
    """
    position, velocity = robot.limits.position, robot.limits.velocity
    assert position is not None
    assert velocity is not None
    lower, upper = np.maximum(position.lower, -3.0), np.minimum(position.upper, 3.0)
    kinematics, found = Kinematics(robot), []
    for number in range(STATES):
        q = random.uniform(lower, upper)
        if number % 3 == 0:
            joint = random.integers(robot.nv)
            q[joint] = random.choice([upper[joint] - 1e-3, lower[joint] + 1e-3])
        moving = number % 2 == 1
        v = random.uniform(-0.5, 0.5, robot.nv) * velocity.upper * moving
        kinematics.update(q)
        V = random.normal(size=6) * np.array([0.75] * 3 + [1.5] * 3)
        if moving:
            V = kinematics.jacobian(robot.frame_id) @ v * random.uniform(0.8, 1.5)
        found.append((q, v, V))
    columns = [np.array(column) for column in zip(*found, strict=True)]
    return columns[0], columns[1], columns[2]


def nominal(q: Array) -> Array:
    """A posture near q."""
    near: Array = q + 0.3 * np.cos(np.arange(len(q)))
    return near


class DrakeFunction:
    """Drake's DoDifferentialInverseKinematics, with or without acceleration limits."""

    def __init__(self, robot: Robot, gain: float, *, acceleration: bool) -> None:
        n = robot.nv
        self.parameters: Any = DifferentialInverseKinematicsParameters(n, n)
        position, velocity = robot.limits.position, robot.limits.velocity
        assert position is not None
        assert velocity is not None
        self.parameters.set_time_step(DT)
        self.parameters.set_joint_position_limits((position.lower, position.upper))
        self.parameters.set_joint_velocity_limits((velocity.lower, velocity.upper))
        if acceleration:
            a = robot.available_acceleration
            assert a is not None
            self.parameters.set_joint_acceleration_limits((-a, a))
        self.parameters.set_nominal_joint_position(robot.q0)
        self.parameters.set_joint_centering_gain(gain * np.eye(n))

    def answer(self, q: Array, v: Array, V: Array, J: Array) -> tuple[bool, Array]:
        """Whether it says that it found a solution, and its velocity."""
        angular_first = np.roll(V, 3), np.roll(J, 3, axis=0)
        result = DoDifferentialInverseKinematics(q, v, *angular_first, self.parameters)
        if not str(result.status).endswith("kSolutionFound"):
            return False, np.full(len(q), np.nan)
        return True, np.array(result.joint_velocities)


class DrakeSystem:
    """Drake's system of least squares (weight 100), joint centring (gain 1), velocity limits."""

    def __init__(self, robot: Robot) -> None:
        builder = RobotDiagramBuilder()
        urdf = urdf_of(robot, position_limits(robot))
        (instance,) = builder.parser().AddModelsFromString(urdf, "urdf")
        checker = SceneGraphCollisionChecker(
            model=builder.Build(), robot_model_instances=[instance], edge_step_size=0.1
        )
        kind = DifferentialInverseKinematicsSystem
        least_squares, centring = kind.LeastSquaresCost.Config(), kind.JointCenteringCost.Config()
        least_squares.cartesian_qp_weight = 100.0
        centring.posture_gain = 1.0
        recipe = kind.Recipe()
        recipe.AddIngredient(kind.LeastSquaresCost(least_squares))
        recipe.AddIngredient(kind.JointCenteringCost(centring))
        recipe.AddIngredient(
            kind.JointVelocityLimitConstraint(
                kind.JointVelocityLimitConstraint.Config(), JointLimits(checker.plant())
            )
        )
        name = checker.plant().GetModelInstanceName(instance)
        self.frame = f"{name}::{TOOL}"
        far = SpatialVelocity(np.full(3, 1e3), np.full(3, 1e3))
        every = DofMask(robot.nv, True)
        self.system = kind(recipe, "world", checker, every, DT, 1.0, far)
        self.context = self.system.CreateDefaultContext()

    def answer(self, q: Array, V: Array) -> Array:
        """Its velocity for a twist (linear; angular) in the axes of the world."""
        wanted = BusValue()
        wanted.Set(self.frame, Value(SpatialVelocity(V[3:], V[:3])))
        for port, value in (
            ("position", q),
            ("nominal_posture", nominal(q)),
            ("desired_cartesian_velocities", wanted),
        ):
            self.system.GetInputPort(port).FixValue(self.context, value)
        v: Array = self.system.GetOutputPort("commanded_velocity").Eval(self.context)
        return v


def bounds(G: Array, h: Array, n: int) -> tuple[Array, Array]:
    """Rows with one entry each as lower and upper bounds, (n,) each."""
    lower, upper = np.full(n, -np.inf), np.full(n, np.inf)
    for row, side in zip(G, h, strict=True):
        (joint,) = np.flatnonzero(row)
        if row[joint] > 0:
            upper[joint] = min(upper[joint], side / row[joint])
        else:
            lower[joint] = max(lower[joint], side / row[joint])
    return lower, upper


def probe(n: int) -> Array:
    """A vector that tells matrices apart: P is kept as P times it."""
    return np.cos(np.arange(n) ** 2)


class Pink:
    """Pink's program and velocity: a frame task, a posture task of cost 1e-2, default limits."""

    def __init__(self, robot: Robot) -> None:
        self.robot = robot
        a = robot.available_acceleration
        model = robot.model
        plain = [pink.limits.ConfigurationLimit(model), pink.limits.VelocityLimit(model)]
        self.acceleration = pink.limits.AccelerationLimit(model, a)
        self.limits = {False: plain, True: [*plain, self.acceleration]}

    def answer(self, q: Array, v: Array, target: Any, *, acceleration: bool) -> dict[str, Array]:
        """The program in Delta q; v is NaN where it finds it infeasible."""
        model = self.robot.model
        configuration = pink.Configuration(model, model.createData(), q)
        frame = pink.tasks.FrameTask(self.robot.frame, 1.0, 1.0)
        frame.set_target(target)
        posture = pink.tasks.PostureTask(POSTURE_COST)
        posture.set_target(nominal(q))
        self.acceleration.set_last_integration(v, DT)
        given = (configuration, [frame, posture], DT)
        limits = self.limits[acceleration]
        program = pink.build_ik(*given, limits=limits)
        try:
            answer = pink.solve_ik(*given, solver="daqp", limits=limits)
        except pink.exceptions.NoSolutionFound:
            answer = np.full(len(q), np.nan)
        return _record(program, answer)


def _record(program: Any, v: Array) -> dict[str, Array]:
    lower, upper = bounds(program.G, program.h, len(v))
    return {
        "Pw": program.P @ probe(len(v)),
        "q": program.q,
        "lower": lower,
        "upper": upper,
        "v": v.astype(np.float32),
    }


class Mink:
    """Likewise mink's."""

    def __init__(self, robot: Robot) -> None:
        self.robot = robot
        self.model = mujoco.MjModel.from_xml_string(urdf_of(robot, position_limits(robot)))
        names = [robot.model.names[joint] for joint in range(1, robot.model.njoints)]
        assert robot.limits.velocity is not None
        fastest = dict(zip(names, robot.limits.velocity.upper.tolist(), strict=True))
        self.limits = [
            mink.ConfigurationLimit(self.model),
            mink.VelocityLimit(self.model, fastest),
        ]

    def answer(self, q: Array, target: Any) -> dict[str, Array]:
        """The program in Delta q, and the velocity."""
        configuration = mink.Configuration(self.model, q=q)
        frame = mink.FrameTask(TOOL, "body", 1.0, 1.0)
        frame.set_target(mink.SE3.from_matrix(target.homogeneous))
        posture = mink.PostureTask(self.model, POSTURE_COST)
        posture.set_target(nominal(q))
        given = (configuration, [frame, posture], DT)
        program = mink.build_ik(*given, limits=self.limits)
        return _record(program, mink.solve_ik(*given, "daqp", limits=self.limits))


def main() -> None:
    """Ask everyone and write the file."""
    random = np.random.default_rng(7)
    kept: dict[str, Any] = {}
    for name in ARMS:
        robot = load_robot(name)
        q, v, V = states(robot, random)
        kept |= {f"{name}/q": q, f"{name}/v_prev": v, f"{name}/V": V}
        kinematics, system = Kinematics(robot), DrakeSystem(robot)
        function = {
            (gain, limited): DrakeFunction(robot, gain, acceleration=limited)
            for gain in GAINS
            for limited in (False, True)
        }
        pinks, minks = Pink(robot), Mink(robot)
        rows: dict[str, list[Array]] = {}
        for state, before, twist in zip(q, v, V, strict=True):
            kinematics.update(state)
            J = kinematics.jacobian(robot.frame_id).copy()
            X = kinematics.placement(robot.frame_id).copy()
            target = X * pin.exp6(pin.Motion(DT * twist))
            answers = {}
            for (gain, limited), asked in function.items():
                solved, answer = asked.answer(state, before, twist, J)
                answers[f"drake/K{gain}{'a' * limited}"] = answer
                assert solved != np.isnan(answer).any()
            R = X.rotation
            world = np.concatenate([R @ twist[:3], R @ twist[3:]])
            answers["drake-system/v"] = system.answer(state, world).astype(np.float32)
            for key, value in pinks.answer(state, before, target, acceleration=False).items():
                answers[f"pink/{key}"] = value
            limited_answer = pinks.answer(state, before, target, acceleration=True)
            for key in ("lower", "upper", "v"):
                answers[f"pink-a/{key}"] = limited_answer[key]
            for key, value in minks.answer(state, target).items():
                answers[f"mink/{key}"] = value
            for key, value in answers.items():
                rows.setdefault(f"{name}/{key}", []).append(value)
        kept |= {key: np.array(values) for key, values in rows.items()}
        print(name, {key: values[0].dtype for key, values in rows.items()}.keys())
    np.savez_compressed(HERE / "random_states.npz", **kept)


if __name__ == "__main__":
    main()
