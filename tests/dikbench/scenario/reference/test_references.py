"""References along joint motions, of arms with any number of joints."""

from __future__ import annotations

import numpy as np
import pinocchio as pin
import pytest

from dikbench.robots.loading import load_robot
from dikbench.scenario.reference.reference import joint_path


@pytest.mark.parametrize("name", ["planar1r", "planar3r", "ur5"])
def test_the_twist_of_a_joint_path_is_the_derivative_of_its_placement(name: str) -> None:
    """By central differences; of a single joint, too, whose Jacobian Pinocchio makes a vector."""
    robot = load_robot(name)
    v = np.linspace(0.5, 1.0, robot.nv)
    path = joint_path(robot, lambda tau: robot.q0 + tau * v, lambda tau: v, 1.0)
    h = 1e-6
    for tau in (0.0, 0.4):
        before, after = path.placement(tau - h), path.placement(tau + h)
        expected = pin.log6(before.actInv(after)).np / (2 * h)
        assert path.velocity(tau) == pytest.approx(expected, abs=1e-7)
