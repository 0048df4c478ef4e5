"""A tracking task and others of its priority as one."""

from __future__ import annotations

import numpy as np
import pinocchio as pin

from dikbench.plugins.building import make_scenario
from dikbench.problem.tasks import PoseTask, PositionTask, TrackingTogether
from dikbench.robots.kinematics import Kinematics
from dikbench.robots.loading import load_robot
from dikbench.scenario.oracle import solve_placement


def test_rows_stand_below_each_other_and_the_target_goes_to_the_tracking() -> None:
    """J, V and error of the hand at this step's target, then those of the elbow at its own."""
    robot = load_robot("panda")
    kinematics = Kinematics(robot)
    kinematics.update(robot.q0)
    elbow = PositionTask(target=np.array([0.1, 0.2, 0.5]), gain=3.0, frame="panda_link4")
    hand = PoseTask(gain=7.0)
    target = kinematics.placement(robot.frame_id) * pin.exp6(0.1 * np.ones(6))
    twist = pin.Motion(np.arange(6.0))
    together = TrackingTogether(hand, (elbow,))
    first, second = hand.linearize(kinematics, target, twist), elbow.linearize(kinematics)
    task = together.linearize(kinematics, target, twist)
    for name in ("J", "V", "error"):
        parts = [getattr(first, name), getattr(second, name)]
        np.testing.assert_array_equal(getattr(task, name), np.concatenate(parts))
    assert (together.gain, together.priority) == (7.0, 1)
    assert together.rows(robot) == (0, 1, 2, 3, 4, 5)


def test_placement_is_found_with_the_others_done() -> None:
    """Gauss-Newton brings the hand to its target while the second link stays."""
    robot = load_robot("panda")
    kinematics = Kinematics(robot)
    kinematics.update(robot.q0)
    link = kinematics.placement(robot.model.getFrameId("panda_link2")).copy()
    still = PoseTask(target=link, frame="panda_link2")  # five joints are left for a position
    target = kinematics.placement(robot.frame_id).copy()
    target.translation += np.array([0.02, -0.03, 0.04])
    together = TrackingTogether(PositionTask(), (still,))
    q = solve_placement(robot, target, robot.q0, tracking=together)
    kinematics.update(q)
    found = kinematics.placement(robot.frame_id).translation
    np.testing.assert_allclose(found, target.translation, atol=1e-9)
    np.testing.assert_allclose(q[:2], robot.q0[:2], atol=1e-8)


def test_what_comes_first_in_a_scenario() -> None:
    """The tracking alone where all else is below it, else with what is beside it."""
    plain = make_scenario("task-conflict")
    assert plain.first is plain.tracking
    standing = make_scenario("humanoid")
    assert isinstance(standing.first, TrackingTogether)
    assert standing.first.others == standing.tasks[:2]
