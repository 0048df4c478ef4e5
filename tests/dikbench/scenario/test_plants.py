"""Plants alone: what they make of one command."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from dikbench.arrays import Array
from dikbench.robots.catalogue import load_robot
from dikbench.robots.limits import Limits
from dikbench.scenario.plant import PLANTS, Ideal, Saturating


@settings(deadline=None)
@given(
    v=arrays(float, 3, elements=st.floats(-20, 20)),
    q=arrays(float, 3, elements=st.floats(-1.5, 1.5)),
    dt=st.floats(1e-3, 0.1),
)
def test_the_saturating_plant_goes_no_further_out(v: Array, q: Array, dt: float) -> None:
    """Inside it ends inside, outside it goes no further out, and no joint waits for another."""
    limits = load_robot("planar3r").with_limits(position=1.0, velocity=2.0).limits.at(q)
    applied = Saturating().drive(v, limits, dt)
    after = q + applied * dt
    assert np.all(np.abs(applied) <= 2.0)
    assert np.all(np.abs(after) <= np.maximum(1.0, np.abs(q)) + 1e-12)
    # From inside, what is applied is the command clipped to where it may go.
    for j in np.flatnonzero(np.abs(q) <= 1.0):
        expected = np.clip(np.clip(v[j], -2, 2), (-1 - q[j]) / dt, (1 - q[j]) / dt)
        assert applied[j] == pytest.approx(expected, abs=1e-12)


def test_without_limits_the_saturating_plant_is_ideal() -> None:
    """Nothing in force clips nothing."""
    free = load_robot("planar3r").with_limits(position=None, velocity=None)
    limits: Limits = free.limits.at(free.q0)
    v = np.array([1e3, -1e3, 0.0])
    assert np.array_equal(Saturating().drive(v, limits, 0.01), v)
    assert PLANTS == {"ideal": Ideal, "saturating": Saturating}
