"""Singular postures: exact, where geometry says, and told apart by what the arm can really do."""

from __future__ import annotations

from math import atan, pi

import numpy as np
import pinocchio as pin
import pytest
from makers.scenarios import known_singularity

from dikbench.arrays import Array
from dikbench.errors import DikbenchError
from dikbench.robots.kinematics import Kinematics, smallest_singular_value
from dikbench.robots.loading import load_robot
from dikbench.robots.robot import Robot
from dikbench.scenario.oracle import position_margin
from dikbench.scenario.singularity import analyse, make_singular, singular_postures
from scenarios.singular_postures import SINGULAR_POSTURES

KNOWN = [(robot, name) for robot, postures in SINGULAR_POSTURES.items() for name in postures]
UR_WRIST = np.array([0.3, -1.2, 1.4, -1.0, 0.0, 0.2])


def _jacobian(robot: Robot, q: Array) -> Array:
    kinematics = Kinematics(robot)
    kinematics.update(q)
    return kinematics.jacobian(robot.frame_id)[list(robot.task_rows)].copy()


@pytest.mark.parametrize(("robot", "name"), KNOWN)
def test_known_postures_are_exactly_singular_and_inside_the_limits(robot: str, name: str) -> None:
    """The smallest singular value is rounding, the one above it is not; nothing moves along n."""
    arm, where = known_singularity(robot, name)
    values = np.linalg.svd(_jacobian(arm, where.q), compute_uv=False)
    assert values[5] < 1e-9
    assert values[4] > 0.01
    assert np.abs(where.lost @ where.jacobian).max() < 1e-9
    assert np.linalg.norm(where.lost) == pytest.approx(1.0)
    assert position_margin(arm, where.q) > 0.1


@pytest.mark.parametrize(
    ("robot", "name", "joint", "value"),
    [
        ("ur5", "wrist", 4, 0.0),
        ("ur5", "elbow", 2, 0.0),
        ("ur3", "elbow", 2, 0.0),
        ("panda", "elbow", 3, -(atan(0.0825 / 0.316) + atan(0.0825 / 0.384))),
        ("panda", "elbow", 4, 0.0),
        ("panda", "shoulder", 1, 0.0),
        ("panda", "wrist", 4, pi / 2),
        ("kinova", "wrist", 4, pi),
        ("kinova", "elbow", 2, pi),
    ],
)
def test_known_postures_are_where_geometry_says(
    robot: str, name: str, joint: int, value: float
) -> None:
    """The joint that makes the arm singular stands where a drawing of the arm puts it."""
    arm, where = known_singularity(robot, name)
    found = pin.difference(arm.model, pin.neutral(arm.model), where.q)[joint]
    assert found == pytest.approx(value, abs=1e-6)


@pytest.mark.parametrize(
    ("robot", "name", "kind"),
    [
        *((robot, "wrist", "crossing") for robot in ("ur3", "ur5", "ur10", "kinova")),
        *((robot, "elbow", "fold") for robot in SINGULAR_POSTURES),
        *((robot, "shoulder", "fold") for robot in ("ur3", "ur5", "ur10", "kinova")),
        *((robot, "wrist", "saddle") for robot in ("panda", "xarm7", "tiago")),
        *((robot, "shoulder", "saddle") for robot in ("panda", "xarm7")),
    ],
)
def test_kinds_of_known_singularities(robot: str, name: str, kind: str) -> None:
    """Wrists of six axes are crossed, elbows are edges, seven axes have saddles."""
    assert known_singularity(robot, name)[1].kind == kind


@pytest.mark.parametrize(("robot", "name"), KNOWN)
def test_curvature_is_what_the_arm_does(robot: str, name: str) -> None:
    """Bent by z, the frame has moved by curvature z^2 / 2 along n, to third order; if at all."""
    arm, where = known_singularity(robot, name)
    kinematics, z = Kinematics(arm), 1e-3
    for side in (1, -1):
        kinematics.update(pin.integrate(arm.model, where.q, side * z * where.bend))
        moved = pin.log6(where.placement.actInv(kinematics.placement(arm.frame_id))).np
        along = where.inward * float(where.lost @ moved)
        if where.kind == "crossing":
            assert abs(along) < 1e-8
        else:
            assert along == pytest.approx(where.curvature * z**2 / 2, rel=0.02)


@pytest.mark.parametrize("robot", ["ur5", "panda", "planar3r"])
def test_no_motion_leads_over_the_edge_of_a_fold(robot: str) -> None:
    """Of a thousand joint motions that keep the frame in place to first order, none gets out."""
    arm = load_robot(robot)
    if robot == "planar3r":
        where = analyse(arm, make_singular(arm, np.array([0.3, 0.1, 1.1])))
    else:
        where = known_singularity(robot, "elbow")[1]
    assert where.kind == "fold"
    Z = np.linalg.svd(where.jacobian)[2][len(arm.task_rows) - 1 :]
    random, kinematics = np.random.default_rng(0), Kinematics(arm)
    for _ in range(1000):
        step = 1e-2 * random.normal(size=len(Z)) @ Z
        kinematics.update(pin.integrate(arm.model, where.q, step))
        moved = pin.log6(where.placement.actInv(kinematics.placement(arm.frame_id))).np
        assert where.inward * float(where.lost @ moved) > -2e-7


@pytest.mark.parametrize(("robot", "name"), KNOWN)
def test_growth_is_the_one_sided_derivative_of_the_singular_value(robot: str, name: str) -> None:
    """Joint by joint, by a small step to either side."""
    arm, where = known_singularity(robot, name)
    for joint, growth in enumerate(where.growth):
        for side in (1, -1):
            step = np.zeros(arm.nv)
            step[joint] = side * 1e-5
            J = _jacobian(arm, pin.integrate(arm.model, where.q, step))
            assert smallest_singular_value(J) / 1e-5 == pytest.approx(growth, abs=2e-3)


def test_a_ur_is_singular_where_its_determinant_says() -> None:
    """Det J ~ sin q3 sin q5 P_x, P_x of the wrist's centre in the arm's plane: a factor is zero."""
    arm, random = load_robot("ur5"), np.random.default_rng(2)
    data, found = arm.model.createData(), []
    for _ in range(40):
        try:
            q = make_singular(arm, random.uniform(-2, 2, 6))
        except DikbenchError:
            continue
        pin.forwardKinematics(arm.model, data, q)
        centre = pin.utils.rotate("z", -q[0]) @ data.oMi[6].translation
        factors = np.abs([np.sin(q[2]), np.sin(q[4]), centre[0]])
        assert factors.min() < 1e-6
        found.append(int(np.argmin(factors)))
    assert set(found) == {0, 1, 2}  # all three kinds were met


def test_a_singular_posture_stays_where_it_is() -> None:
    """Making it singular again moves nothing."""
    assert np.array_equal(make_singular(load_robot("ur5"), UR_WRIST), UR_WRIST)


@pytest.mark.parametrize("robot", ["ur10", "xarm7", "kinova", "lwr", "planar4r"])
def test_a_search_finds_singular_postures_of_any_arm(robot: str) -> None:
    """Always the same ones, with the margin that was asked for."""
    arm = load_robot(robot)
    found = list(singular_postures(arm, 0.2))
    assert len(found) >= 5
    for q in found:
        assert smallest_singular_value(_jacobian(arm, q)) < 1e-9
        assert position_margin(arm, q) >= 0.2
    assert np.array_equal(np.array(found), np.array(list(singular_postures(arm, 0.2))))


@pytest.mark.parametrize(("robot", "q"), [("ur5", UR_WRIST + 0.1), ("lwr", np.zeros(7))])
def test_a_posture_that_loses_none_or_two_directions_is_an_error(robot: str, q: Array) -> None:
    """A UR5 bent at the wrist, and an LWR that stands upright: four of its axes coincide."""
    with pytest.raises(DikbenchError, match="does not lose exactly one direction"):
        analyse(load_robot(robot), q)
