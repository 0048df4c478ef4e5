from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from dikbench import DikbenchError, PostureTask, Status, load_robot, solve_dik

PANDA = load_robot("panda")
FINE: dict[str, Any] = {"formulation": "dls", "twist": [0.1, 0, 0, 0, 0, 0]}


@pytest.mark.parametrize(
    ("change", "expected"),
    [
        ({"dt": "fast"}, "dt: expected a positive finite number"),
        ({"dt": None}, "dt: expected a positive finite number"),
        ({"dt": float("nan")}, "dt: expected a positive finite number"),
        ({"solver": 3}, "solver: expected a selector"),
        ({"tasks": None}, "tasks: expected a list"),
        ({"tasks": PostureTask(target=PANDA.q0)}, "tasks: expected a list"),
        ({"formulation": 3}, "formulation: expected a formulation"),
        (
            {"formulation": "qp", "solver": "osqp[eps_abs=-1]"},
            "eps_abs must be finite and at least 0",
        ),
        (
            {"formulation": "qp", "solver": "piqp[eps_abs=nan]"},
            "eps_abs must be finite and at least 0",
        ),
        (
            {"formulation": "qp", "solver": "daqp[iter_limit=-1]"},
            "iter_limit must be finite and at least 1",
        ),
    ],
)
def test_an_argument_of_the_wrong_kind_is_one_line(change: dict[str, Any], expected: str) -> None:
    """A wrong type or sign is a DikbenchError of one line, never a Python error from within."""
    with pytest.raises(DikbenchError) as caught:
        solve_dik(PANDA, PANDA.q0, **{**FINE, **change})
    assert expected in str(caught.value)
    assert "\n" not in str(caught.value)


def test_a_name_in_place_of_a_robot_says_how_to_load_one() -> None:
    """A robot's name is not a robot."""
    with pytest.raises(DikbenchError, match="load_robot"):
        solve_dik("panda", PANDA.q0, **FINE)  # type: ignore[arg-type]


def test_numbers_of_numpy_are_numbers() -> None:
    """A dt of any of numpy's floating types is taken."""
    for dt in (np.float64(0.01), np.float32(0.01)):
        assert solve_dik(PANDA, PANDA.q0, **{**FINE, "dt": dt}).status is Status.OK
