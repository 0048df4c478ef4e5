"""What peers are asked: models that are the robot's, problems that they are for, the contract."""

from __future__ import annotations

import numpy as np
import pinocchio as pin
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from makers.few_states import few_states
from makers.peers import asked, peer, states_of
from makers.problems import kinematics_at, problem_at

from dikbench import DikbenchError, load_robot
from dikbench.arrays import Array
from dikbench.problem import PositionTask
from dikbench.problem.problem import refusal_of
from dikbench.robots.catalogue import ROBOTS
from dikbench.testing.contract import check_formulation
from formulations.peers.models import (
    SAME,
    TOOL,
    check_same,
    coordinates,
    has_plain_joints,
    position_limits,
    urdf_of,
    velocity_limits,
)

PLAIN = sorted(name for name in ROBOTS if has_plain_joints(load_robot(name)))
CHECKED = (
    "peer-pink[limits=ours]",
    "peer-pink[limits=ours,solver=ours]",
    "peer-mink[limits=ours]",
    "peer-drake[limits=ours]",
    "peer-drake-system[limits=ours]",
    "peer-embodik[limits=ours]",
    "peer-jparse",
)


@pytest.mark.parametrize(("turn", "selector"), [*enumerate(CHECKED)])
def test_each_peer_keeps_the_contract(turn: int, selector: str) -> None:
    """Of formulations, at some states that it does not refuse; the limits that it promises too."""
    with few_states(turn):
        check_formulation(peer(selector))


@pytest.mark.long
@pytest.mark.parametrize("selector", CHECKED)
def test_each_peer_keeps_the_contract_at_every_state(selector: str) -> None:
    """Slow, since a peer makes a model of each of the states' robots."""
    check_formulation(peer(selector))


def test_all_robots_but_those_with_a_free_base_have_models() -> None:
    """The humanoid and the mobile base."""
    assert set(ROBOTS) - set(PLAIN) == {"talos-humanoid", "base"}


@pytest.mark.parametrize("name", PLAIN)
def test_the_written_urdf_is_the_robot(name: str) -> None:
    """Read by Pinocchio: names, limits, placements and Jacobians, at random configurations."""
    robot = load_robot(name)
    model = pin.buildModelFromXML(urdf_of(robot, position_limits(robot)))
    data = model.createData()
    assert list(model.names) == list(robot.model.names)
    assert model.velocityLimit == pytest.approx(np.minimum(velocity_limits(robot), 1e9))
    frame = model.getFrameId(TOOL)

    def at(q: Array) -> tuple[Array, Array]:
        own = q if model.nq == robot.nq else coordinates(robot, q)
        pin.computeJointJacobians(model, data, own)
        X = pin.updateFramePlacement(model, data, frame)
        J = pin.getFrameJacobian(model, data, frame, pin.LOCAL)
        return X.homogeneous, J if J.ndim == 2 else J[:, None]

    check_same(robot, "Pinocchio", at)


@settings(max_examples=10, deadline=None)
@given(st.floats(1e-8, 1.0), st.integers(0, 1))
def test_a_model_that_differs_is_refused_in_one_line(error: float, what: int) -> None:
    """By more than 1e-9 in a placement or a Jacobian, or not a number."""
    robot = load_robot("panda")

    def at(q: Array, error: float = error) -> tuple[Array, Array]:
        kinematics = kinematics_at(robot, q)
        found = (
            kinematics.placement(robot.frame_id).homogeneous,
            kinematics.jacobian(robot.frame_id),
        )
        found[what][1, 2] += error
        return found

    check_same(robot, "right", lambda q: at(q, SAME / 2))
    with pytest.raises(DikbenchError, match=r"robot panda: the model of wrong differs by .* valid"):
        check_same(robot, "wrong", at)
    with pytest.raises(DikbenchError, match="differs by nan"):
        check_same(robot, "wrong", lambda q: at(q, np.nan))


@pytest.mark.parametrize("selector", CHECKED)
def test_what_a_peer_does_not_support_is_refused_beforehand(selector: str) -> None:
    """A free base, rows G v <= h, two tasks of first priority, world axes, another frame."""
    theirs, panda = peer(selector), load_robot("panda")
    still, step = np.zeros(7), np.full(6, 0.1)
    problem = asked(panda, panda.q0, still, step, posture=False)
    assert refusal_of(theirs, problem) == ""
    kinematics = kinematics_at(panda, panda.q0)
    elbow = PositionTask(target=np.zeros(3), frame="panda_link4", priority=1)
    two = [*problem.tasks, elbow.linearize(kinematics)]
    assert "first priority" in refusal_of(theirs, problem_at(panda, panda.q0, two)) or "target" in (
        refusal_of(theirs, problem_at(panda, panda.q0, two))
    )
    rows = asked(panda, panda.q0, still, step)
    rows.G, rows.h = np.zeros((1, 7)), np.ones(1)
    assert "constraints" in refusal_of(theirs, rows)
    world = load_robot("panda", rows="world:xyz")
    assert refusal_of(theirs, asked(world, panda.q0, still, step))
    humanoid = load_robot("talos-humanoid")
    free = asked(humanoid, humanoid.q0, np.zeros(humanoid.nv), step)
    assert "free base" in refusal_of(theirs, free)


@pytest.mark.parametrize("selector", ["peer-drake-system", "peer-embodik", "peer-jparse"])
def test_peers_for_six_rows_refuse_fewer(selector: str) -> None:
    """An arm in the plane."""
    robot = load_robot("planar3r")
    (state,) = states_of(robot, 1)
    assert "six rows" in refusal_of(peer(selector), asked(robot, *state))
