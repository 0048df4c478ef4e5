"""Where a motion breaks a limit first, and by how much."""

from __future__ import annotations

import numpy as np
import pytest

from dikbench.robots.loading import load_robot
from dikbench.scenario.violation import POSITION_TOLERANCE, broken_limit


def test_a_break_of_position_is_as_far_as_the_joint_is_outside_its_range() -> None:
    """From the limit, not from what is tolerated, which is where it counts from."""
    robot = load_robot("planar3r").with_limits(velocity=None, acceleration=None)
    position = robot.limits.position
    assert position is not None
    q = np.tile(robot.q0, (4, 1))
    upper = position.upper[1]
    q[1:, 1] = upper + np.array([0.5, 1.5, 7.0]) * POSITION_TOLERANCE
    rest = np.zeros((3, robot.nv))
    broken = broken_limit(robot, q, np.ones(4, dtype=bool), rest, rest, np.empty(0))
    assert broken is not None
    assert (broken.kind, broken.step) == ("limit-broken", 2)
    assert broken.figure == pytest.approx(1.5 * POSITION_TOLERANCE)
    assert (
        broken_limit(robot, q[:2], np.ones(2, dtype=bool), rest[:1], rest[:1], np.empty(0)) is None
    )
