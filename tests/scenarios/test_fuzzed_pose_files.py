"""Pose files of any content: a scenario whose every number is finite, or an error of one line."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from dikbench.errors import DikbenchError
from dikbench.plugins.building import make_scenario
from dikbench.scenario import Scenario

HEADER = "t,x,y,z,qx,qy,qz,qw"

NUMBERS = st.one_of(
    st.floats(width=32).map(repr),
    st.sampled_from(
        [
            "",
            "0",
            "-0.0",
            "1e-320",
            "1e300",
            "nan",
            "inf",
            "1_0",
            "0x1",
            "1,5",
            "\u0663",
            " 1 ",
            "1e-99999999999999999999",
        ]
    ),
)
"""Values that stand where a number should."""

WORDS = st.sampled_from(
    [
        *HEADER.split(","),
        HEADER,
        "#",
        "\ufeff",
        ",",
        ";",
        "\t",
        "\n",
        "\r\n",
        '"',
        "\x00",
        "0",
        "1e9",
        "a",
    ]
)

FILES = st.one_of(
    st.text(max_size=60),
    st.lists(WORDS, max_size=30).map("".join),
    st.lists(st.lists(NUMBERS, min_size=7, max_size=9).map(",".join), max_size=5).map(
        lambda rows: "\n".join([HEADER, *rows])
    ),
)
"""Texts of which nearly all are no pose files."""


@st.composite
def _near_misses(draw: st.DrawFn) -> str:
    """Valid rows about a planar arm's start, of any spacing, with jumps and repetitions."""
    spans = st.sampled_from([0.1, 0.1, 0.3, 0.05, 0.02, 0.01, 1e-3, 1e-4, 1e-6, 1e-9])
    steps = st.sampled_from([0.0, 0.0, 1e-3, -1e-3, 0.01, -0.01, 0.05, 1e-4, 1e-9, 1e-13])
    turns = st.sampled_from([0.0, 0.0, 0.01, -0.01, 0.1, 1e-9, np.pi / 2, np.pi])
    t, x, y, yaw = draw(st.sampled_from([0.0, -5.0, 1e4])), 0.125, 0.522, 2.5
    rows = [HEADER]
    for _ in range(draw(st.integers(2, 8))):
        numbers = [t, x, y, 0.0, 0.0, 0.0, np.sin(yaw / 2), np.cos(yaw / 2)]
        rows.append(",".join(map(repr, map(float, numbers))))
        t += draw(spans)
        x, y, yaw = x + draw(steps), y + draw(steps), yaw + draw(turns)
    return "\n".join(rows)


def _finite(scenario: Scenario) -> bool:
    """Whether start, target, certificate and exact motion are numbers."""
    motion, reference = scenario.motion, scenario.reference
    assert motion is not None
    at = np.linspace(0.0, reference.duration, 50)
    parts = [
        scenario.q0, scenario.v0, motion.q, motion.v, motion.margin,
        np.array([claim.value for claim in scenario.certificate.claims]),
        np.array([reference.placement(tau).homogeneous for tau in at]),
        np.array([reference.velocity(tau) for tau in at]),
    ]  # fmt: skip
    return all(np.isfinite(part).all() for part in parts)


COUNTS = [
    pytest.param(150, id="normal"),
    pytest.param(10_000, marks=pytest.mark.long, id="long"),
]


@pytest.mark.parametrize("count", COUNTS)
@pytest.mark.parametrize("kind", ["any text", "near misses"])
def test_any_pose_file_makes_a_scenario_or_is_an_error_of_one_line(
    kind: str, count: int, tmp_path: Path
) -> None:
    """Never a traceback, a warning, a hang or a NaN, however rows are joined."""
    path = tmp_path / "poses.csv"

    @settings(max_examples=count, deadline=5000, suppress_health_check=list(HealthCheck))
    @given(
        FILES if kind == "any text" else _near_misses(),
        st.sampled_from(["smooth", "screw", "hold"]),
    )
    def fuzz(text: str, joined: str) -> None:
        path.write_text(text, encoding="utf-8", errors="replace", newline="")
        try:
            made = make_scenario(f"csv[robot=planar3r,file={path},joined={joined},dt=0.02]")
        except DikbenchError as error:
            said = str(error)
        else:
            assert _finite(made)
            return
        assert "\n" not in said
        assert "Error" not in said  # the name of one of Python's exceptions

    fuzz()
