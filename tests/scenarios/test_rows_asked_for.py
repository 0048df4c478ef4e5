"""Families where less than a pose is asked for: nothing is said of the other rows."""

from __future__ import annotations

import numpy as np
import pinocchio as pin
import pytest

from dikbench.plugins.building import make_scenario
from dikbench.robots.example_robot_data import data_file
from dikbench.scenario import placement_of

UR5 = data_file("ur_description/urdf/ur5_robot.urdf")
FOUR_JOINTS = f"robot={UR5},frame=tool0,lock=wrist_2_joint wrist_3_joint"


@pytest.mark.filterwarnings("error")
@pytest.mark.parametrize(
    ("rows", "moved", "turned"),
    [("xyz", 0.1, 0.0), ("world:xyz", 0.1, 0.0), ("world:z", 0.1, 0.0), ("xyzrz", 0.1, 0.3)],
)
@pytest.mark.parametrize("seed", [0, 1])
def test_a_reach_moves_and_turns_by_what_is_asked_for(
    rows: str, moved: float, turned: float, seed: int
) -> None:
    """In the axes of the rows; about what is not asked for the target does not turn."""
    made = make_scenario(f"reach[robot=ur5,rows={rows}]", seed)
    start, target = placement_of(made.robot, made.q0), made.reference.placement(0.0)
    step = pin.log6(start.actInv(target)).np
    assert np.linalg.norm(step[:3]) == pytest.approx(moved)
    assert np.linalg.norm(step[3:]) == pytest.approx(turned, abs=1e-12)
    if rows == "world:z":
        assert (target.translation - start.translation)[:2] == pytest.approx([0, 0], abs=1e-12)
    if turned:
        assert step[3:5] == pytest.approx([0, 0], abs=1e-12)


@pytest.mark.filterwarnings("error")
def test_a_reach_of_an_orientation_alone_turns_on_the_spot() -> None:
    """A wrist that is turned, wherever it goes."""
    made = make_scenario("reach[robot=ur5,rows=rxryrz]")
    start, target = placement_of(made.robot, made.q0), made.reference.placement(0.0)
    assert target.translation == pytest.approx(start.translation)
    assert np.linalg.norm(pin.log3(start.rotation.T @ target.rotation)) == pytest.approx(0.3)


@pytest.mark.parametrize("rows", ["xyz", "world:xyz"])
@pytest.mark.parametrize("miss", [0.005, 0.02])
def test_a_near_miss_of_a_position_is_as_near_as_it_says(rows: str, miss: float) -> None:
    """Four joints at the edge of their reach: the orientation is theirs, the distance is kept."""
    made = make_scenario(f"near-miss[{FOUR_JOINTS},rows={rows},miss={miss}]")
    (apart,) = [c for c in made.certificate.claims if "from the singular placement" in c.quantity]
    assert apart.value == pytest.approx(miss, rel=0.05)
