"""Collision pairs: distances against closed forms, slopes against differences, which there are."""

from __future__ import annotations

import itertools
from pathlib import Path

import numpy as np
import pinocchio as pin
import pytest

from dikbench import (
    BoxObstacle,
    CapsuleObstacle,
    CollisionConstraint,
    DikbenchError,
    Robot,
    SphereObstacle,
    load_robot,
)
from dikbench.arrays import Array
from dikbench.robots.collision.bodies import LINK_RADIUS_M, collision_bodies
from dikbench.robots.collision.pairs import CollisionPairs
from dikbench.robots.example_robot_data import data_file
from dikbench.robots.kinematics import Kinematics

DT = 0.01
SPHERE = SphereObstacle((0.45, 0.3, 0.5), 0.1)
POLE = CapsuleObstacle((0.5, -0.4, 0.0), (0.4, -0.3, 0.9), 0.04)
TURNED = tuple(map(tuple, pin.utils.rpyToMatrix(0.3, -0.5, 0.8).tolist()))
CRATE = BoxObstacle((-0.4, 0.4, 0.5), (0.2, 0.3, 0.25), TURNED)
ALL = (SPHERE, POLE, CRATE)
ROBOTS = ["panda", "ur5", "ur10", "xarm7", "kinova", "tiago", "lwr", "planar4r"]


def at(robot: Robot, q: Array) -> Kinematics:
    """Kinematics of a robot at q."""
    kinematics = Kinematics(robot)
    kinematics.update(q)
    return kinematics


def segments_apart(p: Array, p2: Array, r: Array, r2: Array) -> float:
    """Distance of two segments: the least over the squares' corner, edge and inner minima."""
    d, e = p2 - p, r2 - r

    def closest(t: float) -> float:  # on the second segment, for a point of the first
        return float(np.clip((p + t * d - r) @ e / (e @ e), 0, 1))

    candidates = [(0.0, closest(0.0)), (1.0, closest(1.0))]
    for s in (0.0, 1.0):
        candidates.append((float(np.clip((r + s * e - p) @ d / (d @ d), 0, 1)), s))
    M = np.array([[d @ d, -d @ e], [-d @ e, e @ e]])
    if abs(np.linalg.det(M)) > 1e-12:
        t, s = np.linalg.solve(M, [d @ (r - p), -e @ (r - p)])
        if 0 <= t <= 1 and 0 <= s <= 1:
            candidates.append((t, s))
    return min(float(np.linalg.norm(p + t * d - r - s * e)) for t, s in candidates)


def planar_joints(q: Array, lengths: tuple[float, ...]) -> list[Array]:
    """Where the joints and the tip of a planar arm are."""
    points, angle = [np.zeros(3)], 0.0
    for turn, length in zip(q, lengths, strict=True):
        angle += turn
        points.append(points[-1] + length * np.array([np.cos(angle), np.sin(angle), 0.0]))
    return points


def test_distances_of_a_planar_arm_are_those_of_segments() -> None:
    """Links, sphere, capsule and box against formulas, by an arm whose bodies are known."""
    robot = load_robot("planar4r")
    ball, pole = (
        SphereObstacle((0.3, 0.4, 0.1), 0.05),
        CapsuleObstacle((0, 0.6, -1), (0, 0.7, 1), 0.03),
    )
    wall = BoxObstacle((1.5, 0.0, 0.0), (0.4, 9.0, 9.0))
    random = np.random.default_rng(1)
    pairs = CollisionPairs(robot, (ball, pole, wall), 0.01, self_collision=True)
    assert len(pairs) == 3 + 3 * 4
    for _ in range(100):
        q = random.uniform(-2.5, 2.5, 4)
        points = planar_joints(q, (0.25,) * 4)
        links = list(itertools.pairwise(points))
        apart = [
            segments_apart(*links[i], *links[j]) - 2 * LINK_RADIUS_M
            for i, j in ((0, 2), (0, 3), (1, 3))
        ]
        centre, foot, head = (np.array(x, dtype=float) for x in (ball.centre, pole.start, pole.end))
        for start, end in links:
            way = end - start
            t = np.clip((centre - start) @ way / (way @ way), 0, 1)
            away = float(np.linalg.norm(centre - start - t * way))
            apart.append(away - LINK_RADIUS_M - ball.radius)
        apart += [segments_apart(*link, foot, head) - LINK_RADIUS_M - pole.radius for link in links]
        apart += [1.3 - max(start[0], end[0]) - LINK_RADIUS_M for start, end in links]
        assert pairs.distances(at(robot, q)) == pytest.approx(np.array(apart), abs=1e-6)


def test_robot_of_points_has_no_bodies() -> None:
    """Neither a URDF nor a link that is longer than a point: one line."""
    robot = load_robot("base")
    with pytest.raises(DikbenchError, match="robot base: no collision geometry and no links"):
        CollisionConstraint([SPHERE]).linearize(at(robot, robot.q0), None, DT)


@pytest.mark.parametrize("name", ROBOTS)
def test_gradients_are_the_slopes_of_the_distances(name: str) -> None:
    """Central differences at random postures, inside each other too; every kind of obstacle."""
    robot = load_robot(name)
    pairs = CollisionPairs(robot, ALL, 0.01, self_collision=True)
    everything = np.arange(len(pairs))
    random, step = np.random.default_rng(5), 1e-5
    for _ in range(8):
        q = pin.integrate(robot.model, robot.q0, random.uniform(-1, 1, robot.nv))
        kinematics = at(robot, q)
        pairs.distances(kinematics)
        g = pairs.gradients(kinematics, everything)
        slope = np.empty_like(g)
        for column, direction in enumerate(step * np.eye(robot.nv)):
            there = pairs.distances(at(robot, pin.integrate(robot.model, q, direction)))
            back = pairs.distances(at(robot, pin.integrate(robot.model, q, -direction)))
            slope[:, column] = (there - back) / (2 * step)
        np.testing.assert_allclose(g, slope, atol=1e-4)


def test_bodies_contain_every_vertex_of_the_meshes() -> None:
    """The capsules of the Panda are never farther from a point than its meshes are."""
    robot = load_robot("panda")
    assert robot.urdf is not None
    folders = [str(parent) for parent in Path(robot.urdf).parents]
    full = pin.buildModelFromUrdf(robot.urdf)
    meshes = pin.buildGeomFromUrdf(
        full, robot.urdf, pin.GeometryType.COLLISION, package_dirs=folders
    )
    random = np.random.default_rng(2)
    for _ in range(5):
        q = pin.integrate(robot.model, robot.q0, random.uniform(-1, 1, 7))
        data, placed = full.createData(), meshes.createData()
        pin.updateGeometryPlacements(full, data, meshes, placed, np.concatenate([q, [0, 0]]))
        for index, body in enumerate(meshes.geometryObjects):
            if not hasattr(body.geometry, "vertices"):
                continue
            vertex = random.integers(len(body.geometry.vertices()))
            point = placed.oMg[index].act(body.geometry.vertices()[vertex])
            inside = CollisionPairs(
                robot, [SphereObstacle(tuple(point), 1e-6)], 0.01, self_collision=False
            )
            if body.parentJoint == 0:
                continue
            own = [names[0] for names in inside.names].index(body.name)
            assert inside.distances(at(robot, q))[own] < 1e-6


@pytest.mark.parametrize("name", ROBOTS)
def test_safe_start_is_clear_and_neighbours_are_no_pairs(name: str) -> None:
    """No pair is in contact at the start; bodies of one joint and the next are never a pair."""
    robot = load_robot(name)
    pairs = CollisionPairs(robot, (), 0.01, self_collision=True)
    assert pairs.distances(at(robot, robot.q0)).min() >= 0.01
    assert len(pairs) >= 1
    assert not set(pairs.names) & set(pairs.left_out)
    for first, second in pairs.joints:
        assert first != second
        assert robot.model.parents[second] != first
        assert robot.model.parents[first] != second
    # Neighbours touch: they are not even looked at.
    assert name not in ("planar4r", "panda") or pairs.left_out == ()


def test_srdf_and_safe_start_decide_what_is_left_out() -> None:
    """The Panda's SRDF rules out links 5 and 7; TIAGo's first links are in its torso's capsule."""
    panda = CollisionPairs(load_robot("panda"), (), 0.01, self_collision=True)
    assert ("panda_link5_0", "panda_link7_0") not in panda.names
    assert ("panda_link0_0", "panda_hand_0") in panda.names
    assert panda.left_out == ()
    tiago = CollisionPairs(load_robot("tiago"), (), 0.01, self_collision=True)
    assert ("torso_lift_link_0", "arm_2_link_0") in tiago.left_out


def test_locked_fingers_move_with_the_hand() -> None:
    """The geometry is reduced as the model is: nothing is left on the fingers' joints."""
    pairs = CollisionPairs(load_robot("panda"), (SPHERE,), 0.01, self_collision=False)
    fingers = [index for index, names in enumerate(pairs.names) if "finger" in names[0]]
    assert len(fingers) == 8
    kinematics = at(load_robot("panda"), load_robot("panda").q0)
    pairs.distances(kinematics)
    assert np.abs(pairs.gradients(kinematics, np.array(fingers))[:, :6]).max() > 0.1


def test_missing_mesh_is_one_line(tmp_path: Path) -> None:
    """A URDF whose mesh is not there loads; a collision constraint says what is missing."""
    urdf = tmp_path / "arm.urdf"
    urdf.write_text(
        '<robot name="arm"><link name="base"/><link name="tip"><collision><geometry>'
        '<mesh filename="package://nowhere/tip.stl"/></geometry></collision></link>'
        '<joint name="turn" type="revolute"><parent link="base"/><child link="tip"/>'
        '<axis xyz="0 0 1"/><limit lower="-1" upper="1" effort="1" velocity="1"/></joint></robot>'
    )
    robot = load_robot(str(urdf), "tip")
    with pytest.raises(DikbenchError, match=r"collision geometry: .*tip\.stl") as caught:
        CollisionConstraint([SPHERE]).pairs(robot)
    assert "\n" not in str(caught.value)


def test_scaled_meshes_have_scaled_bodies(tmp_path: Path) -> None:
    """Twice the Panda's first link: a capsule twice as thick and long."""
    mesh = data_file("panda_description/meshes/collision/link1.stl")
    urdf = tmp_path / "arm.urdf"
    urdf.write_text(
        '<robot name="arm"><link name="base"/><link name="tip"><collision><geometry>'
        f'<mesh filename="{mesh}" scale="2 2 2"/></geometry></collision></link>'
        '<joint name="turn" type="revolute"><parent link="base"/><child link="tip"/>'
        '<axis xyz="0 0 1"/><limit lower="-1" upper="1" effort="1" velocity="1"/></joint></robot>'
    )
    large = collision_bodies(load_robot(str(urdf), "tip")).geometryObjects[0].geometry
    bodies = collision_bodies(load_robot("panda")).geometryObjects
    (own,) = (body.geometry for body in bodies if body.name == "panda_link1_0")
    assert large.radius == pytest.approx(2 * own.radius)
    assert large.halfLength == pytest.approx(2 * own.halfLength)


def test_a_urdf_of_ones_own_has_its_primitive_shapes(tmp_path: Path) -> None:
    """A sphere on a turning link: its distance from a ball is the closed form, and its slope."""
    urdf = tmp_path / "arm.urdf"
    urdf.write_text(
        '<robot name="arm"><link name="base"/><link name="tip"><collision>'
        '<origin xyz="0.5 0 0"/><geometry><sphere radius="0.1"/></geometry></collision></link>'
        '<joint name="turn" type="revolute"><parent link="base"/><child link="tip"/>'
        '<axis xyz="0 0 1"/><limit lower="-3" upper="3" effort="1" velocity="1"/></joint></robot>'
    )
    robot = load_robot(str(urdf), "tip", start=[0.0])
    pairs = CollisionPairs(robot, [SphereObstacle((0, 0.5, 0.2), 0.05)], 0.01, self_collision=False)
    for angle in (-1.0, 0.3, 1.2):
        kinematics = at(robot, np.array([angle]))
        apart = np.array([0, 0.5, 0.2]) - 0.5 * np.array([np.cos(angle), np.sin(angle), 0])
        length = np.linalg.norm(apart)
        assert pairs.distances(kinematics) == pytest.approx([length - 0.15])
        slope = -0.5 * np.array([-np.sin(angle), np.cos(angle), 0]) @ apart / length
        assert pairs.gradients(kinematics, np.array([0])) == pytest.approx(np.array([[slope]]))
