"""Our versions and the real libraries, asked the same problems: one velocity to 1e-6 rad/s.

Where a peer is known to answer differently the test of that difference is in
`test_known_differences.py`; here nothing may differ without a reason that the peer states.
"""

from __future__ import annotations

import numpy as np
import pytest
from makers.peers import asked, peer, states_of
from makers.problems import solve_for
from makers.turns import in_turns

from dikbench import load_robot
from dikbench.plugins.building import make_formulation
from dikbench.problem import Robot
from dikbench.problem.problem import refusal_of

SAME = 1e-6
EXACT = "daqp[preset=high]"
EXACT_PEERS = (
    "peer-pink[limits=ours]",
    "peer-pink[limits=ours,solver=ours]",
    "peer-pink",
    "peer-mink[limits=ours]",
    "peer-mink[limits=ours,solver=ours]",
    "peer-jparse",
)
"""Those that differ nowhere inside the limits."""


def difference(selector: str, robot: Robot, count: int, *, posture: bool = True) -> list[float]:
    """The largest difference [rad/s] at each state of which the peer states no reason."""
    theirs = peer(selector)
    ours = make_formulation(theirs.counterpart)
    found = []
    for moving in (False, True):
        for q, before, V in states_of(robot, count):
            problem = asked(robot, q, before, V, posture=posture, moving=moving)
            assert refusal_of(theirs, problem) == ""
            v = theirs.velocity(problem, solve_for(theirs, EXACT))
            found.append(np.abs(v - ours.velocity(problem, solve_for(ours, EXACT))).max())
    return found


@pytest.mark.parametrize(
    ("selector", "name"), in_turns(EXACT_PEERS, ["panda", "ur5", "ur10", "xarm7"])
)
def test_those_without_a_solver_of_their_own(selector: str, name: str) -> None:
    """At random states, a third 1 mrad from a limit, at rest and at speed, saturated or not."""
    assert max(difference(selector, load_robot(name), 40)) < SAME


@pytest.mark.parametrize("selector", ["peer-pink[limits=ours]", "peer-mink[limits=ours]"])
@pytest.mark.parametrize("name", ["planar3r", "planar4r", "kinova", "lwr", "tiago", "talos"])
def test_other_arms(selector: str, name: str) -> None:
    """In the plane, with joints that go round, built in code, with other joints locked."""
    assert max(difference(selector, load_robot(name), 10)) < SAME


@pytest.mark.parametrize("name", ["kinova", "lwr", "tiago"])
def test_jparse_of_other_arms(name: str) -> None:
    """Continuous joints, built in code, with other joints locked."""
    assert max(difference("peer-jparse", load_robot(name), 10)) < SAME


@pytest.mark.parametrize(
    "selector", ["peer-pink[limits=ours]", "peer-pink[limits=ours,solver=ours]"]
)
def test_pink_with_acceleration_limits(selector: str) -> None:
    """Its braking bound as well; where its bounds contradict each other it has no answer."""
    robot = load_robot("ur5")
    robot = robot.with_limits(acceleration=robot.available_acceleration)
    assert max(difference(selector, robot, 40)) < SAME


@pytest.mark.parametrize("centering", [0.0, 1.0])
def test_drakes_function_where_its_program_is_linear(centering: float) -> None:
    """Arms of six joints, and of three in the plane, go to CLP, whose corners are exact."""
    for name in ("ur5", "ur10", "planar3r", "kinova"):
        selector = f"peer-drake[limits=ours,centering={centering}]"
        assert max(difference(selector, load_robot(name), 20)) < SAME


@pytest.mark.parametrize("centering", [0.0, 1.0])
@pytest.mark.parametrize("name", ["panda", "xarm7", "planar4r"])
def test_drakes_function_where_its_solver_is_osqp(name: str, centering: float) -> None:
    """All states but few, of which `test_known_differences` says why."""
    found = difference(f"peer-drake[limits=ours,centering={centering}]", load_robot(name), 60)
    assert sum(each > SAME for each in found) <= 2


@pytest.mark.parametrize("name", ["ur5", "ur10"])
def test_embodik_where_no_joint_is_to_spare(name: str) -> None:
    """The same scale where six joints are asked for six rows."""
    robot = load_robot(name)
    selector = "peer-embodik[limits=ours,damping=ours]"
    assert max(difference(selector, robot, 40, posture=False)) < SAME


@pytest.mark.parametrize("miss", [0.0, 1e-6, 1e-3, 1e-2, 0.1])
@pytest.mark.parametrize("selector", [*EXACT_PEERS, "peer-drake[limits=ours]"])
def test_at_a_singular_wrist(selector: str, miss: float) -> None:
    """A UR5 from its singular wrist on: bounds decide, and both obey the same ones."""
    theirs, robot = peer(selector), load_robot("ur5")
    ours = make_formulation(theirs.counterpart)
    q = np.array([0.3, -1.2, 1.4, -1.7, miss, 0.2])
    V = np.array([0.05, 0.02, -0.03, 0.3, -0.2, 0.1])
    for posture in (False, True):
        problem = asked(robot, q, np.zeros(6), V, posture=posture)
        v = theirs.velocity(problem, solve_for(theirs, EXACT))
        expected = ours.velocity(problem, solve_for(ours, EXACT))
        if not posture and "jparse" not in selector and "drake" not in selector and miss < 1e-5:
            # Without a posture the motion that does nothing is free: it is compared in its effect.
            J = problem.primary.J
            v, expected = J @ v, J @ expected
        assert v == pytest.approx(expected, abs=1e-5 if miss < 1e-5 else SAME)
