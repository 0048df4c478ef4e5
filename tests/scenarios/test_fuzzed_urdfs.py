"""Arms of any joints and ranges: a scenario that starts inside the limits, or one line."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from makers.urdfs import Joint, write_arm

from dikbench.errors import DikbenchError
from dikbench.plugins.building import make_scenario

numbers = st.one_of(
    st.floats(-10, 10).map(repr),
    st.sampled_from(["0", "-0.0", "1e-9", "1e9", "nan", "inf", "-inf", "", "x", "6.3", "-3"]),
)
axes = st.one_of(
    st.sampled_from(["0 0 1", "0 1 0", "1 0 0", "0 0 -2", "1 1 0", "0 0 0", "0 0"]),
    st.lists(numbers, min_size=3, max_size=3).map(" ".join),
)
usual = st.sampled_from(
    [
        'lower="-3" upper="3" effort="10" velocity="2"',
        'lower="0" upper="0.04" velocity="1" effort="9"',
    ]
)
odd = st.lists(
    st.tuples(st.sampled_from(["lower", "upper", "velocity", "effort"]), numbers),
    max_size=4,
    unique_by=lambda pair: pair[0],
).map(lambda pairs: " ".join(f'{name}="{value}"' for name, value in pairs))
mimics = st.one_of(
    st.just(""),
    st.just(""),
    st.builds(
        'joint="j{}" multiplier="{}" offset="{}"'.format, st.integers(1, 8), numbers, numbers
    ),
)
joints = st.builds(
    Joint,
    axis=st.one_of(st.sampled_from(["0 0 1", "0 1 0", "1 0 0"]), axes),
    kind=st.sampled_from(["revolute", "revolute", "revolute", "continuous", "prismatic", "fixed"]),
    limit=st.one_of(usual, usual, usual, odd),
    mimic=mimics,
    offset=st.sampled_from(["0.3 0 0", "0 0 0.2", "0 0 0", "0.1 0.05 0.2"]),
)
options = st.fixed_dictionaries(
    {},
    optional={
        "rows": st.sampled_from(["xyz", "rxryrz", "world:xy", "x", "xyzrxry", "xyrz"]),
        "lock": st.sampled_from(["j1", "j2 j3", "g1", "j1=0.1"]),
        "root": st.sampled_from(["planar", "free"]),
        "velocity": st.sampled_from(["1", "1 2", "0"]),
        "acceleration": st.sampled_from(["10", "true", "1 1 1"]),
    },
)
FAMILIES = ("reach", "near-miss", "pick-and-place", "speed-sweep", "workspace-boundary")


def one_arm(
    folder: Path,
    arm: list[Joint],
    gripper: list[Joint],
    chosen: dict[str, str],
    family: str,
    seed: int,
) -> bool:
    """Make a scenario of an arm; return whether there is one."""
    path = write_arm(folder, arm, gripper=gripper)
    given = ",".join(f"{name}={value}" for name, value in {"frame": "tool", **chosen}.items())
    message = ""
    try:
        scenario = make_scenario(f'{family}[robot="{path}",{given}]', seed)
    except DikbenchError as error:
        message = str(error)
    if message:
        assert "\n" not in message
        assert not re.search(r"\b[A-Z]\w+Error:|Warning|\bnan\b.*residual|residual nan", message)
        return False
    at = scenario.robot.limits.at(scenario.q0)
    assert at.to_lower is not None
    assert at.to_upper is not None
    assert np.isfinite(scenario.q0).all()
    assert min(at.to_lower.min(), at.to_upper.min()) >= 0
    return True


CASES: dict[str, Any] = {
    "arm": st.lists(joints, min_size=1, max_size=8),
    "gripper": st.lists(joints, max_size=2),
    "chosen": options,
    "family": st.sampled_from(FAMILIES),
    "seed": st.integers(0, 3),
}
suppressed = [HealthCheck.function_scoped_fixture, HealthCheck.too_slow]


@settings(max_examples=500, deadline=None, suppress_health_check=suppressed)
@given(**CASES)
def test_any_arm_makes_a_scenario_or_one_line(tmp_path: Path, **case: Any) -> None:
    """Whose start is inside the limits of all joints, at every seed."""
    one_arm(tmp_path, **case)


@pytest.mark.long
@settings(max_examples=20_000, deadline=None, suppress_health_check=suppressed)
@given(**CASES)
def test_many_arms(tmp_path: Path, **case: Any) -> None:
    """The same, of more."""
    one_arm(tmp_path, **case)
