"""What is drawn of a robot is where the robot is."""

from __future__ import annotations

import itertools
from itertools import combinations
from pathlib import Path

import numpy as np
import pinocchio as pin
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.spatial import ConvexHull

from dikbench.arrays import Array
from dikbench.robots.catalogue import ROBOTS
from dikbench.robots.example_robot_data import DataModel
from dikbench.robots.loading import load_robot
from dikbench.robots.stick_figure import stick
from dikbench.viewer.capsules import capsules
from dikbench.viewer.simplified_meshes import GRID_M, hull, simplified_meshes

ARM = """<robot name="arm">
  <link name="base"/>
  <link name="one"><visual><geometry>{}</geometry></visual></link>
  <joint name="turn" type="revolute"><parent link="base"/><child link="one"/>
    <origin xyz="0 0 0.3"/><axis xyz="0 1 0"/>
    <limit lower="-1" upper="1" velocity="1" effort="1"/></joint>
  <link name="tool"/>
  <joint name="end" type="fixed"><parent link="one"/><child link="tool"/>
    <origin xyz="0.5 0 0"/></joint>
</robot>"""


@pytest.mark.parametrize("name", ["panda", "talos"])
def test_locked_joints_lock_their_meshes(name: str) -> None:
    """Meshes of the reduced arm are where those of the whole robot are, others at zero."""
    build = ROBOTS[name].model
    assert isinstance(build, DataModel)
    whole_model, robot = DataModel(build.urdf)(), load_robot(name)
    assert robot.visuals is not None
    whole, drawn = DataModel(build.urdf).visuals(), robot.visuals()
    q = np.random.default_rng(0).uniform(-0.5, 0.5, robot.nq)
    whole_q = pin.neutral(whole_model)
    for joint, value in zip(robot.model.names[1:], q, strict=True):
        whole_q[whole_model.joints[whole_model.getJointId(joint)].idx_q] = value
    placements = []
    for model, geometry, at in ((whole_model, whole, whole_q), (robot.model, drawn, q)):
        data = geometry.createData()
        pin.updateGeometryPlacements(model, model.createData(), geometry, data, at)
        names = [body.name for body in geometry.geometryObjects]
        placements.append(dict(zip(names, (X.homogeneous for X in data.oMg), strict=True)))
    assert placements[0].keys() == placements[1].keys()
    for key, placement in placements[0].items():
        np.testing.assert_allclose(placements[1][key], placement, atol=1e-12)


@pytest.mark.parametrize("name", ["planar3r", "lwr", "panda"])
def test_capsules_reach_from_joint_to_joint(name: str) -> None:
    """Their ends are the points of the stick figure, which is computed otherwise."""
    robot = load_robot(name)
    geometry = capsules(robot)
    data = geometry.createData()
    q = np.random.default_rng(1).uniform(-1, 1, robot.nq)
    pin.updateGeometryPlacements(robot.model, robot.model.createData(), geometry, data, q)
    ends = []
    for body, X in zip(geometry.geometryObjects, data.oMg, strict=True):
        half = np.array([0.0, 0.0, body.geometry.halfLength])
        ends.append([X.act(-half), X.act(half)])
    points = stick(robot, q)
    legs = [leg for leg in itertools.pairwise(points) if np.ptp(leg, axis=0).any()]
    np.testing.assert_allclose(ends[: len(legs)], legs, atol=1e-12)


def test_a_point_is_a_disc() -> None:
    """A mobile base is one joint without a length: a disc that moves with it stands for it."""
    (disc,) = capsules(load_robot("base")).geometryObjects
    assert disc.parentJoint == 1
    assert disc.geometry.radius > disc.geometry.halfLength > 0


def test_a_urdf_s_own_shapes(tmp_path: Path) -> None:
    """They are drawn; where a mesh is missing capsules stand in for them."""
    file = tmp_path / "arm.urdf"
    file.write_text(ARM.format('<box size="0.5 0.1 0.1"/>'))
    ((joint, box),) = simplified_meshes(load_robot(str(file), "tool")).items()
    assert joint == 1
    np.testing.assert_allclose(np.ptp(box.vertices, axis=0), [0.5, 0.1, 0.1], atol=GRID_M)
    file.write_text(ARM.format('<mesh filename="package://elsewhere/one.stl"/>'))
    found = simplified_meshes(load_robot(str(file), "tool"))
    assert sorted(found) == [0, 1]
    np.testing.assert_allclose(np.ptp(found[1].vertices, axis=0).max(), 0.5 + 0.032, atol=2e-3)


def test_hulls_are_where_the_meshes_are() -> None:
    """The hulls of a link reach as far as its meshes along each axis, and not farther."""
    robot = load_robot("ur5")
    assert robot.visuals is not None
    simplified = simplified_meshes(robot)
    clouds: dict[int, list[Array]] = {}
    for body in robot.visuals().geometryObjects:
        shape = body.geometry
        corners = {t[k] for t in map(shape.tri_indices, range(shape.num_tris)) for k in range(3)}
        vertices = np.asarray(shape.vertices()).reshape(-1, 3)[sorted(corners)]
        at = vertices @ body.placement.rotation.T + body.placement.translation
        clouds.setdefault(body.parentJoint, []).append(at)
    assert simplified.keys() == clouds.keys()
    for joint, parts in clouds.items():
        whole = np.vstack(parts)
        for direction in np.vstack([np.eye(3), -np.eye(3)]):
            reach = (whole @ direction).max(), (simplified[joint].vertices @ direction).max()
            assert reach[1] == pytest.approx(reach[0], abs=0.02 * np.ptp(whole, axis=0).max())


@given(st.integers(0, 2**32 - 1), st.integers(20, 140))
def test_a_hull_is_closed_and_faces_outwards(seed: int, corners: int) -> None:
    """Euler's formula holds, and the volume by the divergence theorem is that of the points."""
    points = np.random.default_rng(seed).normal(size=(30, 3))
    mesh = hull(points, corners)
    edges = {frozenset(pair) for face in mesh.faces.tolist() for pair in combinations(face, 2)}
    assert len(mesh.vertices) - len(edges) + len(mesh.faces) == 2
    a, b, c = np.moveaxis(mesh.vertices[mesh.faces], 1, 0)
    volume = np.einsum("ij,ij->i", a, np.cross(b, c)).sum() / 6
    assert volume == pytest.approx(ConvexHull(mesh.vertices).volume)
    assert volume <= ConvexHull(points).volume * (1 + 1e-3)
