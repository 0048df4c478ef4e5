"""A payload in the hand: what it weighs is felt, and nothing else changes."""

from __future__ import annotations

import numpy as np
import pinocchio as pin
import pytest

from dikbench.errors import DikbenchError
from dikbench.robots.kinematics import Kinematics
from dikbench.robots.loading import load_robot
from dikbench.robots.payload import with_payload


@pytest.mark.parametrize("name", ["panda", "ur5", "kinova"])
def test_payload_weighs_what_it_weighs(name: str) -> None:
    """The torques that hold it are J^T m g more, with J the Jacobian of the task frame's origin."""
    robot, mass = load_robot(name), 2.5
    loaded = with_payload(robot, mass)
    kinematics, random = Kinematics(robot), np.random.default_rng(0)
    for _ in range(20):
        q = pin.integrate(robot.model, robot.q0, random.uniform(-1, 1, robot.nv))
        kinematics.update(q)
        R = kinematics.placement(robot.frame_id).rotation
        up = R @ kinematics.jacobian(robot.frame_id)[:3]
        more = pin.computeGeneralizedGravity(loaded.model, loaded.model.createData(), q)
        more = more - pin.computeGeneralizedGravity(robot.model, robot.model.createData(), q)
        np.testing.assert_allclose(more, up.T @ np.array([0, 0, mass * 9.81]), atol=1e-9)


def test_payload_resists_as_a_ball_does() -> None:
    """The kinetic energy is m |V|^2/2 + I |w|^2/2 more, with I = 2/5 m r^2."""
    robot, mass, radius = load_robot("panda"), 2.0, 0.1
    loaded = with_payload(robot, mass, radius)
    v = np.random.default_rng(1).uniform(-1, 1, robot.nv)
    kinematics = Kinematics(robot)
    kinematics.update(robot.q0)
    V = kinematics.jacobian(robot.frame_id) @ v
    energies = [pin.computeKineticEnergy(r.model, r.scratch, r.q0, v) for r in (loaded, robot)]
    expected = mass / 2 * V[:3] @ V[:3] + 0.4 * mass * radius**2 / 2 * V[3:] @ V[3:]
    assert energies[0] - energies[1] == pytest.approx(expected)


def test_robot_itself_is_not_changed() -> None:
    """The catalogue's model is shared by everyone; frames, limits and start are the same."""
    robot = load_robot("panda")
    before = pin.computeTotalMass(robot.model)
    loaded = with_payload(robot, 3.0)
    assert pin.computeTotalMass(robot.model) == before
    assert pin.computeTotalMass(loaded.model) == pytest.approx(before + 3.0)
    assert (loaded.frame_id, loaded.limits) == (robot.frame_id, robot.limits)
    assert np.array_equal(loaded.q0, robot.q0)


@pytest.mark.parametrize("given", [(0.0, 0.05), (-1.0, 0.05), (np.inf, 0.05), (1.0, 0.0)])
def test_payload_must_weigh_something(given: tuple[float, float]) -> None:
    """One line that names what was given."""
    with pytest.raises(DikbenchError, match=r"payload: (mass|radius)=.* must be positive"):
        with_payload(load_robot("ur5"), *given)
