"""Collision rows: what they say of a velocity, ways back, braking, and what they leave out."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import pinocchio as pin
import pytest
from makers.problems import kinematics_at
from makers.scenarios import error_of

from dikbench import (
    BoxObstacle,
    CapsuleObstacle,
    CollisionConstraint,
    SphereObstacle,
    load_robot,
    solve_dik,
)
from dikbench.robots.collision.obstacles import Obstacle

DT = 0.01
TWO_NUMBERS: Any = (0, 0)
NO_OBSTACLES: Any = [(0, 0, 0)]
SPHERE = SphereObstacle((0.45, 0.3, 0.5), 0.1)
POLE = CapsuleObstacle((0.5, -0.4, 0.0), (0.4, -0.3, 0.9), 0.04)
TURNED = tuple(map(tuple, pin.utils.rpyToMatrix(0.3, -0.5, 0.8).tolist()))
CRATE = BoxObstacle((-0.4, 0.4, 0.5), (0.2, 0.3, 0.25), TURNED)
ALL = (SPHERE, POLE, CRATE)


def test_rows_are_unit_or_vacuous_and_their_number_is_constant() -> None:
    """At any posture: so many rows, finite, of length one or zero with h = 1."""
    robot = load_robot("panda")
    constraint = CollisionConstraint(ALL, rows=12)
    random = np.random.default_rng(0)
    seen = set()
    for _ in range(200):
        q = pin.integrate(robot.model, robot.q0, random.uniform(-1.5, 1.5, 7))
        G, h = constraint.linearize(kinematics_at(robot, q), None, DT)
        assert G.shape == (12, 7)
        assert np.isfinite(G).all()
        assert np.isfinite(h).all()
        length = np.linalg.norm(G, axis=1)
        vacuous = length == 0
        assert length[~vacuous] == pytest.approx(1.0)
        assert (h[vacuous] == 1).all()
        seen.add(int(vacuous.sum()))
    assert len(seen) > 3


def test_rows_say_what_the_distances_do() -> None:
    """For a small step the room of a row is the distance after it less the margin, over dt |g|."""
    robot = load_robot("ur5")
    constraint = CollisionConstraint([SPHERE, POLE], self_collision=False, influence=10.0)
    pairs = constraint.pairs(robot)
    kinematics = kinematics_at(robot, robot.q0)
    G, h = constraint.linearize(kinematics, None, DT)
    g = pairs.gradients(kinematics, np.arange(len(pairs)))
    v = 1e-3 * np.random.default_rng(4).uniform(-1, 1, 6)
    after = pairs.distances(kinematics_at(robot, pin.integrate(robot.model, robot.q0, v * DT)))
    room = (h - G @ v) * np.linalg.norm(g, axis=1) * DT
    clear = pairs.distances(kinematics) > constraint.margin
    assert clear.sum() > 10
    assert room[clear] == pytest.approx((after - constraint.margin)[clear], abs=1e-9)


def test_nearest_pairs_have_the_rows() -> None:
    """With fewer rows than pairs none is without a row that is nearer than one that has it."""
    robot = load_robot("xarm7")
    few, all_rows = (CollisionConstraint(ALL, rows=rows, influence=10) for rows in (5, 100))
    phi = few.pairs(robot).distances(kinematics_at(robot, robot.q0))
    G, h = few.linearize(kinematics_at(robot, robot.q0), None, DT)
    every_G, every_h = all_rows.linearize(kinematics_at(robot, robot.q0), None, DT)
    nearest = np.sort(np.argsort(phi)[:5])
    np.testing.assert_array_equal(G, every_G[nearest])
    np.testing.assert_array_equal(h, every_h[nearest])


@pytest.mark.parametrize("kind", ["sphere", "capsule", "box"])
def test_inside_an_obstacle_the_way_back_is_bounded(kind: str) -> None:
    """Fingers in an obstacle leave it all the way, and no row asks for more than its rate."""
    robot = load_robot("panda")
    tip = kinematics_at(robot, robot.q0).placement(robot.frame_id).translation
    x, y, z = tip[0], tip[1], tip[2] - 0.03
    shapes: dict[str, Obstacle] = {
        "sphere": SphereObstacle((x, y, z), 0.05),
        "capsule": CapsuleObstacle((x - 0.2, y, z), (x + 0.2, y, z), 0.04),
        "box": BoxObstacle((x, y, z), (0.3, 0.3, 0.08)),
    }
    constraint = CollisionConstraint([shapes[kind]], self_collision=False)
    q, distance = robot.q0, [constraint.distances(robot, robot.q0[None])[0]]
    assert distance[0] < -0.015
    velocity = robot.limits.velocity
    assert velocity is not None
    for _ in range(60):
        G, h = constraint.linearize(kinematics_at(robot, q), None, DT)
        assert (h >= -0.1 * np.abs(G) @ velocity.upper - 1e-12).all()
        answer = solve_dik(
            robot, q, formulation="qp", twist=np.zeros(6), dt=DT, constraints=[constraint]
        )
        assert answer.status.value != "infeasible"
        q = pin.integrate(robot.model, q, DT * answer.velocity)
        distance.append(constraint.distances(robot, q[None])[0])
    assert np.diff(distance).min() > -1e-6
    assert distance[1] - distance[0] > 1e-4
    assert distance[-1] == pytest.approx(constraint.margin, abs=1e-6)


def test_touching_and_concentric_bodies_are_finite() -> None:
    """At distance zero the normal is there; where there is none the row is vacuous, never NaN."""
    robot = load_robot("planar4r")
    q = np.array([0.0, 0.3, 0.3, 0.3])
    for offset in (0.04 + 0.05, 0.0):
        ball = SphereObstacle((0.12, offset, 0.0), 0.05)
        constraint = CollisionConstraint([ball], self_collision=False)
        pairs = constraint.pairs(robot)
        phi = pairs.distances(kinematics_at(robot, q))[0]
        assert phi == pytest.approx(offset - 0.09, abs=1e-9)
        G, h = constraint.linearize(kinematics_at(robot, q), None, DT)
        assert np.isfinite(G).all()
        assert np.isfinite(h).all()
    touching = CollisionConstraint([SphereObstacle((0.12, 0.09, 0), 0.05)], self_collision=False)
    G, h = touching.linearize(kinematics_at(robot, q), None, DT)
    assert G[0] == pytest.approx([1, 0, 0, 0])  # turning left runs into it
    crossed = CapsuleObstacle((0.12, 0, -1), (0.12, 0, 1), 0.05)
    G, h = CollisionConstraint([crossed], self_collision=False).linearize(
        kinematics_at(robot, q), None, DT
    )
    assert np.isfinite(G).all()
    assert (G[0] == 0).all()
    assert h[0] == 1


def test_what_no_joint_can_change_has_no_say() -> None:
    """A ball over the first joint's axis touches the first link for ever: the arm still moves."""
    robot = load_robot("planar3r")
    axle = CollisionConstraint([SphereObstacle((0, 0, 0.06), 0.03)], self_collision=False)
    assert axle.distances(robot, robot.q0[None])[0] == pytest.approx(-0.01)
    G, h = axle.linearize(kinematics_at(robot, robot.q0), None, DT)
    assert (G == 0).all()
    assert (h == 1).all()
    answer = solve_dik(
        robot, robot.q0, formulation="qp", twist=[0.1, 0, 0, 0, 0, 0], dt=DT, constraints=[axle]
    )
    assert answer.progress == pytest.approx(1.0, abs=1e-3)


def test_rows_ask_for_no_more_than_the_joints_can_brake() -> None:
    """From any speed some velocity within reach of it keeps each row by itself.

    Without acceleration limits, or with no velocity to change, rows do not brake.
    """
    robot = load_robot("ur5")
    slow = robot.with_limits(acceleration=robot.available_acceleration)
    assert slow.limits.acceleration is not None
    reach = DT * slow.limits.acceleration.upper
    constraint = CollisionConstraint(ALL, influence=1.0)
    random, braking = np.random.default_rng(8), 0
    for _ in range(100):
        q = pin.integrate(robot.model, robot.q0, random.uniform(-0.7, 0.7, 6))
        before = random.uniform(-1, 1, 6)
        G, h = constraint.linearize(kinematics_at(slow, q), before, DT)
        assert (G @ before - np.abs(G) @ reach <= h + 1e-12).all()
        _, free = constraint.linearize(kinematics_at(robot, q), before, DT)
        _, still = constraint.linearize(kinematics_at(slow, q), None, DT)
        np.testing.assert_array_equal(free, still)
        braking += int((h < free - 1e-9).sum())
    assert braking > 100


def test_remainder_is_of_second_order() -> None:
    """Half the step, a quarter of the remainder; it and the slope make up the change."""
    robot = load_robot("panda")
    constraint = CollisionConstraint(ALL, influence=10.0)
    direction = np.random.default_rng(7).uniform(-1, 1, 7)
    sizes = []
    for size in (0.02, 0.01):
        q = np.array([robot.q0, pin.integrate(robot.model, robot.q0, size * direction)])
        sizes.append(constraint.remainders(robot, q)[0])
    ratio = sizes[0] / sizes[1]
    assert np.median(ratio) == pytest.approx(4.0, abs=0.2)
    assert np.abs(sizes[0]).max() < 1e-3


def test_rows_do_not_depend_on_what_was_asked_before() -> None:
    """To the bit: distances of boxes and cylinders are iterative, and start from the same guess."""
    robot = load_robot("tiago")
    constraint = CollisionConstraint(ALL, rows=500, influence=10.0)
    first = constraint.linearize(kinematics_at(robot, robot.q0), None, DT)
    random = np.random.default_rng(0)
    for _ in range(20):
        q = pin.integrate(robot.model, robot.q0, random.uniform(-1, 1, robot.nv))
        constraint.linearize(kinematics_at(robot, q), None, DT)
    again = constraint.linearize(kinematics_at(robot, robot.q0), None, DT)
    np.testing.assert_array_equal(first[0], again[0])
    np.testing.assert_array_equal(first[1], again[1])


def test_distances_are_the_least_of_the_pairs() -> None:
    """Of each configuration of a motion."""
    robot = load_robot("xarm7")
    constraint = CollisionConstraint(ALL)
    q = robot.q0 + np.linspace(0, 1, 5)[:, None] * 0.2
    one_by_one = [constraint.pairs(robot).distances(kinematics_at(robot, x)).min() for x in q]
    np.testing.assert_array_equal(constraint.distances(robot, q), one_by_one)


@pytest.mark.parametrize(
    ("make", "part"),
    [
        (lambda: SphereObstacle((0, 0, 0), 0.0), "SphereObstacle: radius=0.0 must be positive"),
        (lambda: SphereObstacle(TWO_NUMBERS, 1.0), "SphereObstacle: centre: expected shape"),
        (lambda: CapsuleObstacle((0, 0, 0), (0, 0, 0), 1.0), "start and end are one point"),
        (lambda: BoxObstacle((0, 0, 0), (1, 1, -1)), "BoxObstacle: size=-1.0 must be positive"),
        (lambda: BoxObstacle((0, 0, 0), (1, 1, 1), ((2, 0, 0),) * 3), "rotation matrix"),
        (lambda: CollisionConstraint(margin=0.2), "margin=0.2 must be at least 0 and below"),
        (lambda: CollisionConstraint(rows=0), "rows=0 must be at least 1"),
        (lambda: CollisionConstraint(NO_OBSTACLES), "expected a list of SphereObstacle"),
        (
            lambda: CollisionConstraint(self_collision=False).pairs(load_robot("ur5")),
            "robot ur5: a collision constraint without obstacles",
        ),
    ],
)
def test_impossible_constraints_are_one_line(make: Callable[[], object], part: str) -> None:
    """What, where, what would be valid."""
    assert part in error_of(make)
