"""The loops that the harness is compared with: the same motion, each peer as its users call it."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import pinocchio as pin

from dikbench.scenario import Scenario
from formulations.peers.models import TOOL, position_limits, urdf_of

Tick = Callable[[], int]

DAMPING = 0.05
POSTURE_COST = 1e-2
"""Its square is the weight of our posture task."""


def bare_dls_tick(scenario: Scenario) -> Tick:
    """Damped least squares as a roboticist writes it down, on Pinocchio and numpy; no records."""
    model, frame = scenario.robot.model, scenario.robot.frame_id
    data, dt, gain = model.createData(), scenario.dt, scenario.tracking.gain
    targets = [(X, twist.np) for X, twist in scenario.targets]
    damped = DAMPING**2 * np.eye(6)

    def run() -> int:
        q = scenario.q0
        for k in range(scenario.steps):
            X_d, V_d = targets[k]
            pin.computeJointJacobians(model, data, q)
            relative = pin.updateFramePlacement(model, data, frame).actInv(X_d)
            V = gain * pin.log6(relative).np + relative.toActionMatrix() @ V_d
            J = pin.getFrameJacobian(model, data, frame, pin.LOCAL)
            v = J.T @ np.linalg.solve(J @ J.T + damped, V)
            q = pin.integrate(model, q, v * dt)
        return scenario.steps

    return run


def pink_tick(scenario: Scenario) -> Tick:
    """Pink: `solve_ik` and `integrate_inplace`, daqp, its default limits."""
    import pink

    robot, dt = scenario.robot, scenario.dt
    targets = [X for X, _ in scenario.targets]
    frame = pink.tasks.FrameTask(robot.frame, 1.0, 1.0, gain=scenario.tracking.gain * dt)
    posture = pink.tasks.PostureTask(POSTURE_COST, gain=dt)
    posture.set_target(scenario.q0)

    def run() -> int:
        configuration = pink.Configuration(robot.model, robot.model.createData(), scenario.q0)
        for k in range(scenario.steps):
            frame.set_target(targets[k])
            v = pink.solve_ik(configuration, [frame, posture], dt, solver="daqp")
            configuration.integrate_inplace(v, dt)
        return scenario.steps

    return run


def mink_tick(scenario: Scenario) -> Tick:
    """Mink on MuJoCo: `solve_ik` and `integrate_inplace`, daqp, position and velocity limits."""
    import mink
    import mujoco

    robot, dt = scenario.robot, scenario.dt
    model = mujoco.MjModel.from_xml_string(urdf_of(robot, position_limits(robot)))
    frame = mink.FrameTask(TOOL, "body", 1.0, 1.0, gain=scenario.tracking.gain * dt)
    posture = mink.PostureTask(model, POSTURE_COST, gain=dt)
    names = [robot.model.names[joint] for joint in range(1, robot.model.njoints)]
    assert robot.limits.velocity is not None
    fastest = dict(zip(names, robot.limits.velocity.upper.tolist(), strict=True))
    limits = [mink.ConfigurationLimit(model), mink.VelocityLimit(model, fastest)]
    targets = [mink.SE3.from_matrix(X.homogeneous) for X, _ in scenario.targets]

    def run() -> int:
        configuration = mink.Configuration(model, q=scenario.q0)
        posture.set_target(scenario.q0)
        for k in range(scenario.steps):
            frame.set_target(targets[k])
            v = mink.solve_ik(configuration, [frame, posture], dt, "daqp", limits=limits)
            configuration.integrate_inplace(v, dt)
        return scenario.steps

    return run


def drake_tick(scenario: Scenario) -> Tick:
    """Drake's function on the same kinematics as ours: it gets J and V for nothing."""
    from pydrake.multibody.inverse_kinematics import (
        DifferentialInverseKinematicsParameters,
        DoDifferentialInverseKinematics,
    )

    robot, dt, gain = scenario.robot, scenario.dt, scenario.tracking.gain
    model, frame, data = robot.model, robot.frame_id, robot.model.createData()
    parameters: Any = DifferentialInverseKinematicsParameters(model.nq, model.nv)
    parameters.set_time_step(dt)
    position, velocity = robot.limits.position, robot.limits.velocity
    assert position is not None
    assert velocity is not None
    parameters.set_joint_position_limits((position.lower, position.upper))
    parameters.set_joint_velocity_limits((velocity.lower, velocity.upper))
    parameters.set_nominal_joint_position(scenario.q0)
    targets = scenario.targets

    def run() -> int:
        q, v = scenario.q0, scenario.v0
        for k in range(scenario.steps):
            X_d, V_d = targets[k]
            pin.computeJointJacobians(model, data, q)
            relative = pin.updateFramePlacement(model, data, frame).actInv(X_d)
            V = gain * pin.log6(relative).np + relative.act(V_d).np
            J = pin.getFrameJacobian(model, data, frame, pin.LOCAL)
            v = DoDifferentialInverseKinematics(q, v, V, J, parameters).joint_velocities
            q = pin.integrate(model, q, v * dt)
        return scenario.steps

    return run
