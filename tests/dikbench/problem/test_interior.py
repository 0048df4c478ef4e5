"""Away from position limits the box takes a short cut: same bounds, to the last bit."""

from __future__ import annotations

from typing import get_args

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from dikbench.problem import velocity_box as box_module
from dikbench.problem.velocity_box import Box, Braking, velocity_box
from dikbench.robots.limits import Interval, JointLimits

BRAKINGS = get_args(Braking)

magnitudes = st.one_of(st.floats(1e-3, 30.0), st.sampled_from([0.0, np.inf]))


@st.composite
def joint_limits(draw: st.DrawFn) -> JointLimits:
    """One joint's limits, kinds out of force, zero and infinite ones among them."""

    def interval() -> Interval:
        return Interval(*(np.array([side]) for side in (-draw(magnitudes), draw(magnitudes))))

    position = draw(st.sampled_from(["both", "upper", "none"]))
    sides = {"both": (-1.0, 2.0), "upper": (-np.inf, 2.0)}.get(position)
    return JointLimits(
        nv=1,
        q_index=np.arange(1),
        position=None if sides is None else Interval(*(np.array([side]) for side in sides)),
        velocity=interval() if draw(st.integers(0, 4)) else None,
        acceleration=interval() if draw(st.booleans()) else None,
        effort=None,
    )


def _plain(joint: JointLimits, x: float, v_prev: float | None, dt: float, how: Braking) -> Box:
    """The box computed without the short cut."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(box_module, "_interior", lambda *arguments: None)
        return velocity_box(
            joint.at(np.array([x])), None if v_prev is None else np.array([v_prev]), dt, how
        )


@settings(deadline=None, max_examples=600)
@given(
    joint=joint_limits(),
    x=st.floats(-1.2, 2.2),
    v_prev=st.one_of(st.none(), st.floats(-40, 40)),
    dt=st.sampled_from([1e-3, 0.01, 0.05]),
    braking=st.sampled_from(BRAKINGS),
)
def test_the_short_cut_changes_no_bit(
    joint: JointLimits, x: float, v_prev: float | None, dt: float, braking: Braking
) -> None:
    """Whatever the limits and wherever the joint is."""
    previous = None if v_prev is None else np.array([v_prev])
    short = velocity_box(joint.at(np.array([x])), previous, dt, braking)
    plain = _plain(joint, x, v_prev, dt, braking)
    assert short.lower.tolist() == plain.lower.tolist()
    assert short.upper.tolist() == plain.upper.tolist()
    assert short.relaxed == plain.relaxed


@settings(deadline=None, max_examples=200)
@given(
    speed=st.floats(1e-3, 10.0),
    deceleration=st.floats(0.1, 50.0),
    dt=st.sampled_from([1e-3, 0.01]),
    braking=st.sampled_from(BRAKINGS),
    beyond=st.floats(-1e-6, 1e-6),
)
def test_the_short_cut_begins_where_the_brake_ends(
    speed: float, deceleration: float, dt: float, braking: Braking, beyond: float
) -> None:
    """Within a micrometre of the place where the brake first allows full speed."""
    joint = JointLimits(
        nv=1,
        q_index=np.arange(1),
        position=Interval(np.array([-1e4]), np.array([0.0])),
        velocity=Interval(np.array([-speed]), np.array([speed])),
        acceleration=Interval(np.array([-deceleration]), np.array([deceleration])),
        effort=None,
    )
    low, high = -1e3, 0.0
    for _ in range(100):  # bisect for the last place where full speed is allowed
        middle = (low + high) / 2
        free = float(_plain(joint, middle, None, dt, braking).upper[0]) >= speed
        low, high = (middle, high) if free else (low, middle)
    x = low + beyond
    short = velocity_box(joint.at(np.array([x])), None, dt, braking)
    assert short.upper.tolist() == _plain(joint, x, None, dt, braking).upper.tolist()
    interior = box_module._interior(joint, dt, braking, 0.5)
    assert interior is not None
    assert interior.holds(np.array([low - 1e-6]))
    assert not interior.holds(np.array([high + 1e-6]))
