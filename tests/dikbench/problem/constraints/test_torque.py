"""Torque rows: what they say of a velocity is what the equation of motion says."""

from __future__ import annotations

import numpy as np
import pinocchio as pin
import pytest

from dikbench import DikbenchError, Robot, TorqueConstraint, load_robot, solve_dik
from dikbench.arrays import Array
from dikbench.problem.constraints.torque import mass_matrix
from dikbench.robots.kinematics import Kinematics

DT = 0.005
ROBOTS = ["panda", "ur5", "xarm7", "kinova"]


def bounded(name: str) -> Robot:
    """A robot with the effort limits of its model in force."""
    robot = load_robot(name)
    return robot.with_limits(effort=robot.available_effort)


@pytest.mark.parametrize("name", ROBOTS)
def test_rows_hold_exactly_where_the_torques_are_inside(name: str) -> None:
    """For random steps the least room of the rows has the sign of the least room of the torques."""
    robot = bounded(name)
    random = np.random.default_rng(3)
    effort = robot.limits.effort
    assert effort is not None
    kinematics = Kinematics(robot)
    seen = set()
    for _ in range(200):
        q = pin.integrate(robot.model, robot.q0, random.uniform(-1, 1, robot.nv))
        before = random.uniform(-1, 1, robot.nv)
        v = before + DT * random.uniform(-1, 1, robot.nv) * 10 ** random.uniform(-1, 4)
        kinematics.update(q)
        G, h = TorqueConstraint().linearize(kinematics, before, DT)
        tau = pin.rnea(robot.model, robot.model.createData(), q, before, (v - before) / DT)
        room = float(np.min(np.minimum(effort.upper - tau, tau - effort.lower)))
        assert np.sign(room) == np.sign(np.min(h - G @ v))
        np.testing.assert_allclose(np.linalg.norm(G, axis=1), 1.0)
        seen.add(np.sign(room))
    assert seen == {-1.0, 1.0}


@pytest.mark.parametrize("name", ROBOTS)
def test_slope_of_the_torque_is_the_mass_matrix(name: str) -> None:
    """Finite differences of the Newton-Euler torques in v give M/dt, the rows before scaling."""
    robot = bounded(name)
    before = np.full(robot.nv, 0.3)
    constraint = TorqueConstraint()

    def torque(v: Array) -> Array:
        found: Array = constraint.torques(robot, robot.q0[None], v[None], before[None], DT)[0]
        return found

    slope = np.column_stack(
        [(torque(before + 1e-3 * e) - torque(before - 1e-3 * e)) / 2e-3 for e in np.eye(robot.nv)]
    )
    M = mass_matrix(robot, robot.q0)
    np.testing.assert_allclose(slope * DT, M, atol=1e-9)
    kinematics = Kinematics(robot)
    kinematics.update(robot.q0)
    G, _ = constraint.linearize(kinematics, before, DT)
    np.testing.assert_allclose(G[: robot.nv], M / np.linalg.norm(M, axis=1, keepdims=True))


def test_a_limit_on_one_side_alone_is_a_row() -> None:
    """The other side of the joint, and joints without any limit, have none."""
    both = bounded("panda")
    effort = both.limits.effort
    assert effort is not None
    lower, upper = effort.lower.copy(), effort.upper.copy()
    lower[1], upper[2], lower[3], upper[3] = -np.inf, np.inf, -np.inf, np.inf
    robot = both.with_limits(effort=(lower, upper))
    kinematics = Kinematics(robot)
    kinematics.update(robot.q0)
    before = np.linspace(-0.5, 0.5, 7)
    G, h = TorqueConstraint().linearize(kinematics, before, DT)
    every = Kinematics(both)
    every.update(both.q0)
    all_rows, all_bounds = TorqueConstraint().linearize(every, before, DT)
    kept = np.concatenate([np.isfinite(upper), np.isfinite(lower)])
    np.testing.assert_array_equal(kept.nonzero()[0], [0, 1, 4, 5, 6, 7, 9, 11, 12, 13])
    np.testing.assert_allclose(G, all_rows[kept], atol=1e-15)
    np.testing.assert_allclose(h, all_bounds[kept], atol=1e-12)


def test_law_keeps_the_torques_where_it_is_told_to() -> None:
    """A twist that asks for a jump from rest passes the effort limits; with the rows `qp` does not.

    The torques are those of the Newton-Euler algorithm, and the most loaded joint is at its limit.
    """
    robot = bounded("panda")
    rest = np.zeros(7)
    constraint = TorqueConstraint()
    usage = {}
    for label, constraints in (("free", ()), ("bound", (constraint,))):
        answer = solve_dik(
            robot, robot.q0, formulation="qp", twist=[0, 0, -1.5, 0, 0, 0], dt=DT, v_prev=rest,
            constraints=constraints,
        )  # fmt: skip
        tau = constraint.torques(robot, robot.q0[None], answer.velocity[None], rest[None], DT)
        effort = robot.limits.effort
        assert effort is not None
        usage[label] = effort.usage(tau).max()
    assert usage["free"] > 2
    assert usage["bound"] == pytest.approx(1.0, abs=1e-6)


def test_robot_without_effort_limits_is_one_line() -> None:
    """The error says what is missing and how to set it."""
    robot = load_robot("panda")
    kinematics = Kinematics(robot)
    kinematics.update(robot.q0)
    with pytest.raises(DikbenchError, match="panda: a torque constraint needs effort limits"):
        TorqueConstraint().linearize(kinematics, None, DT)
