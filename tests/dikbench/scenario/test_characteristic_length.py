"""The characteristic length of a scenario: how far a turn counts as a way."""

from math import sin

import numpy as np
import pinocchio as pin
import pytest
from makers.scenarios import scenario_of

from dikbench.errors import DikbenchError

THETA = 0.3
AXIS = np.array([0.6, 0.0, 0.8])
AWAY = np.array([0.0, 0.0, 0.01])


@pytest.mark.parametrize("family", ["reach", "near-miss", "humanoid"])
@pytest.mark.parametrize("length", [0.1, 0.5])
def test_a_turn_counts_as_so_much_of_a_way(family: str, length: float) -> None:
    """A turn by theta is 2 L sin(theta / 2) away, a way its own length, of held frames too."""
    case = scenario_of(f"{family}[characteristic_length={length}]", 0)
    assert case.feasible == scenario_of(family, 0).feasible
    X = case.reference.placement(0.0)
    frames = [(case.embedding, X.rotation, X.translation)]
    frames += [(each.embedding, each.rotation, each.translation) for each in case.held_frames]
    for embedding, R, p in frames:
        turned = R @ pin.exp3(THETA * AXIS)
        here, there, elsewhere = embedding.points(
            np.array([R, turned, R]), np.array([p, p, p + AWAY])
        )
        assert np.linalg.norm(here - there) == pytest.approx(2 * length * sin(THETA / 2))
        assert np.linalg.norm(here - elsewhere) == pytest.approx(np.linalg.norm(AWAY))


@pytest.mark.parametrize("value", ["0", "-0.2", "nan", "inf"])
def test_it_is_a_length(value: str) -> None:
    """What is no length is refused by name."""
    with pytest.raises(DikbenchError, match="characteristic_length"):
        scenario_of(f"reach[characteristic_length={value}]")
