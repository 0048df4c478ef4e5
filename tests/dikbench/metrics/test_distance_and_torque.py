"""Distances and torques of motions made by hand."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pinocchio as pin
import pytest

from dikbench import SphereObstacle
from dikbench.metrics import METRICS, motion_of
from dikbench.metrics.distance_and_torque import CONSTRAINTS
from dikbench.problem.constraints import CollisionConstraint, Constraint, TorqueConstraint
from dikbench.problem.tasks import PoseTask
from dikbench.robots.loading import load_robot
from dikbench.robots.robot import Robot, model_limits
from dikbench.scenario import Scenario
from dikbench.scenario.certificate import Certificate
from dikbench.scenario.reference.reference import target_at_rest
from dikbench.simulation.trace import Trace

DT, GRAVITY = 0.1, 9.81
MASS, LENGTH = 2.0, 0.5
STILL_TORQUE = MASS * GRAVITY * LENGTH


def values(robot: Robot, speeds: list[float], *constraints: Constraint) -> dict[str, float]:
    """The metrics of this file, of a motion of joint 1 from q = 0 and from rest."""
    n = len(speeds)
    v = np.zeros((n, robot.nv))
    v[:, 0] = speeds
    q = np.zeros((n + 1, robot.nq))
    q[1:] = np.cumsum(v, axis=0) * DT
    none, nothing = np.zeros(n, dtype=int), np.zeros(n)
    wanted = np.zeros((n, len(robot.task_rows)))
    trace = Trace(
        DT,
        q,
        DT * np.arange(n + 1.0),
        wanted,
        v,
        v,
        none,
        none,
        none,
        none,
        nothing,
        nothing,
        nothing,
        nothing,
    )
    scenario = Scenario(
        robot=robot,
        q0=q[0],
        v0=np.zeros(robot.nv),
        reference=target_at_rest(pin.SE3.Identity(), max(n, 1) * DT),
        tracking=PoseTask(gain=1.0),
        dt=DT,
        duration=max(n, 1) * DT,
        certificate=Certificate(()),
        constraints=constraints,
    )
    motion = motion_of(trace, scenario)
    return {metric.name: metric.of(motion) for metric in CONSTRAINTS}


def pendulum(effort: object) -> Robot:
    """A point mass at the end of a rod that turns about a horizontal axis, level at q = 0."""
    model = pin.Model()
    joint = model.addJoint(0, pin.JointModelRY(), pin.SE3.Identity(), "swing")
    point = pin.Inertia(MASS, np.array([LENGTH, 0.0, 0.0]), np.zeros((3, 3)))
    model.appendBodyToJoint(joint, point, pin.SE3.Identity())
    model.addFrame(pin.Frame("tip", joint, pin.SE3.Identity(), pin.FrameType.OP_FRAME))
    robot = Robot("pendulum", model, "tip", model_limits(model), np.zeros(1), task_rows=(4,))
    return robot.with_limits(effort=effort)


def sphere(x: float, y: float) -> CollisionConstraint:
    """A sphere of 0.06 m in the plane of an arm, to be kept 0.05 m away from."""
    return CollisionConstraint(
        [SphereObstacle((x, y, 0.0), 0.06)], self_collision=False, margin=0.05, influence=0.5
    )


def test_torque_of_a_pendulum() -> None:
    """Gravity at rest is m g l = 9.81 N m; a step to 1 rad/s asks for m l^2 10 rad/s^2 = 5 more.

    The rod is level and turns downwards (about +y), so that gravity helps: 9.81 - 5 = 4.81 N m hold
    against it; from then on 9.81 cos(q), and stopping at q = 0.1 takes 5 N m more.
    """
    found = values(pendulum((-12.0, 12.0)), [1.0, 0.0], TorqueConstraint())
    stopping = STILL_TORQUE * math.cos(0.1) + 5.0
    assert found["torque_usage_max"] == pytest.approx(stopping / 12, rel=1e-12)
    assert found["torque_violating_share"] == 0.5
    roomy = values(pendulum((-15.0, 15.0)), [1.0, 0.0], TorqueConstraint())
    assert roomy["torque_violating_share"] == 0.0


def test_a_torque_at_its_limit_is_no_violation() -> None:
    """A pendulum that is held at rest uses all of a limit of m g l; a hair less, and it passes it.

    Only the side of the torque counts: the weight pulls the joint to positive angles, the torque
    that holds it is negative.
    """
    held = values(pendulum((-STILL_TORQUE, 1.0)), [0.0], TorqueConstraint())
    assert held["torque_usage_max"] == pytest.approx(1.0, rel=1e-12)
    assert held["torque_violating_share"] == 0.0
    short = values(pendulum((-STILL_TORQUE * (1 - 1e-5), 1.0)), [0.0], TorqueConstraint())
    assert short["torque_violating_share"] == 1.0


def test_distances_of_a_link_from_a_sphere() -> None:
    """A straight arm turns by 0.1 rad towards a sphere beside its first link.

    The link is a capsule of radius 0.04 m about the x axis and the sphere's centre is at distance r
    = 0.3 m, turned by 0.5 rad: the gap is r sin(0.5 - q) - 0.1. From q = 0 to 0.1 rad it loses
    r cos(0.5) 0.1 by the first derivative, and the rest is the second-order term.
    """
    x, y = 0.3 * math.cos(0.5), 0.3 * math.sin(0.5)
    found = values(load_robot("planar3r"), [1.0], sphere(x, y))
    before, after = 0.3 * math.sin(0.5) - 0.1, 0.3 * math.sin(0.4) - 0.1
    assert found["distance_min_m"] == pytest.approx(after, abs=1e-9)
    assert found["distance_violation_max_m"] == pytest.approx(0.05 - after, abs=1e-9)
    linear = before - 0.3 * math.cos(0.5) * 0.1
    assert found["distance_remainder_max_m"] == pytest.approx(max(linear - after, 0.0), abs=1e-9)
    clear = values(load_robot("planar3r"), [-1.0], sphere(x, y))
    assert clear["distance_min_m"] == pytest.approx(before, abs=1e-9)
    back = 0.3 * math.sin(0.6) - 0.1
    fallen = before + 0.3 * math.cos(0.5) * 0.1 - back
    assert clear["distance_remainder_max_m"] == pytest.approx(fallen, abs=1e-9)
    far = values(load_robot("planar3r"), [-1.0], replace(sphere(x, y), margin=0.01))
    assert far["distance_violation_max_m"] == 0.0


def test_the_nearest_of_several_constraints_counts() -> None:
    """Each with its own margin: a farther sphere with a large margin is what is violated."""
    near, wide = sphere(0.2, 0.25), replace(sphere(0.2, -0.3), margin=0.25)
    found = values(load_robot("planar3r"), [0.0], replace(near, margin=0.01), wide)
    assert found["distance_min_m"] == pytest.approx(0.15, abs=1e-9)
    assert found["distance_violation_max_m"] == pytest.approx(0.05, abs=1e-9)


def test_without_constraints_nothing_is_measured() -> None:
    """NaN, as for a run of no step; torques count only where the scenario limits them."""
    for robot, speeds in ((load_robot("planar3r"), [1.0]), (pendulum(1.0), [1.0])):
        assert all(math.isnan(value) for value in values(robot, speeds).values())
    nothing = values(pendulum(1.0), [], TorqueConstraint())
    assert math.isnan(nothing["torque_usage_max"])


def test_every_metric_of_constraints_is_in_the_registry() -> None:
    """And so it is a column of every table of trials."""
    assert {metric.name for metric in CONSTRAINTS} <= set(METRICS)
