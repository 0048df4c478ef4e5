"""Needs: read from texts, and met by trials."""

from __future__ import annotations

from functools import cache

import pandas as pd
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from makers.rows import make_rows

from dikbench.advice.needs import DEFAULTS, Need, parsed_need
from dikbench.errors import DikbenchError


@pytest.mark.parametrize(
    ("text", "need"),
    [
        ("on-path=1mm", Need("on-path", 0.001)),
        ("on-path=0.002m", Need("on-path", 0.002)),
        ("on-time=2 cm", Need("on-time", 0.02)),
        ("on-path", Need("on-path", 0.005)),
        ("limits", Need("limits")),
    ],
)
def test_a_need_is_read(text: str, need: Need) -> None:
    """With its unit; 5 mm where no distance is given."""
    found = parsed_need(text)
    assert found.kind == need.kind
    assert found.tolerance == pytest.approx(need.tolerance)


@pytest.mark.parametrize(
    "text",
    [
        "",
        "fast",
        "on-path=",
        "on-path=1 mile",
        "on-path=1",
        "on-time=0.002",
        "on-path=-1mm",
        "limits=3",
        "on-path=nan",
    ],
)
def test_what_is_no_need_is_one_line(text: str) -> None:
    """And says what would be valid."""
    with pytest.raises(DikbenchError, match="valid: on-path=1mm") as caught:
        parsed_need(text)
    assert "\n" not in str(caught.value)


@settings(max_examples=25)
@given(st.floats(1e-4, 0.5), st.floats(1e-4, 0.5))
def test_a_larger_tolerance_is_met_by_whoever_met_a_smaller_one(one: float, other: float) -> None:
    """Success does not fall as a tolerance grows."""
    rows = distances()
    small, large = sorted((one, other))
    met = Need("on-path", small).met(rows), Need("on-path", large).met(rows)
    assert not (met[0] & ~met[1]).any()


@cache
def distances() -> pd.DataFrame:
    """Make trials of one law at growing distances from their paths."""
    away = [10.0**-k for k in range(6)]
    names = [f"reach[distance={k}]" for k in range(len(away))]
    return make_rows({"a": {"contour_error_6d_max_m": away}}, scenarios=names, reference="path")


def test_limits_are_kept_by_whoever_left_the_path() -> None:
    """A broken limit, a collision and a run that broke off are what counts."""
    outcomes = ["success", "left-path", "limit-broken", "collided", "did-not-run", "chattering"]
    rows = pd.DataFrame({"outcome": outcomes})
    assert Need("limits").met(rows).tolist() == [True, True, False, False, False, True]


def test_the_defaults_are_needs() -> None:
    """Each of them, and all different."""
    assert len({str(parsed_need(text)) for text in DEFAULTS}) == len(DEFAULTS)
