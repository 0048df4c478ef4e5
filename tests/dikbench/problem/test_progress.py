"""Progress and off course: step values checked by hand."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from dikbench.arrays import Array
from dikbench.problem.progress import (
    DWELL_SPEED_M_S,
    STANDSTILL_SPEED_SHARE,
    off_course,
    progress,
    row_weights,
)

SPACE = row_weights((0, 1, 2, 3, 4, 5))
EQUAL = np.ones(6)
X = np.array([1.0, 0, 0, 0, 0, 0])
Y = np.array([0, 1.0, 0, 0, 0, 0])
ROLL = np.array([0, 0, 0, 1.0, 0, 0])

twists = arrays(float, 6, elements=st.floats(-5, 5))


def _both(wanted: Array, achieved: Array, weights: Array = SPACE) -> tuple[float, float]:
    V, V_a = wanted[None], achieved[None]
    return float(progress(V, V_a, weights)[0]), float(off_course(V, V_a, weights)[0])


# --- progress and off course


def test_rows_of_a_rotation_weigh_in_by_a_length() -> None:
    """M = diag(1, 1, 1, L^2, L^2, L^2) with L = 0.2 m; the weights are its square roots."""
    assert np.array_equal(SPACE, [1, 1, 1, 0.2, 0.2, 0.2])
    assert np.array_equal(row_weights((0, 1, 5)), [1, 1, 0.2])
    assert np.array_equal(row_weights((3, 0), length=0.5), [0.5, 1])


@pytest.mark.parametrize(
    ("wanted", "achieved", "alpha", "angle"),
    [
        (2 * X, 2 * X, 1.0, 0.0),
        (2 * X, X, 0.5, 0.0),
        (2 * X, 3 * X, 1.5, 0.0),
        (2 * X, -2 * X, -1.0, math.pi),  # reversal
        (X, Y, 0.0, math.pi / 2),
        (X, X + Y, 1.0, math.pi / 4),
        (X, -X + Y, -1.0, 3 * math.pi / 4),
        (X, X + 5 * ROLL, 1.0, math.pi / 4),  # 5 rad/s at 0.2 m is 1 m/s
        (ROLL, 0.5 * ROLL, 0.5, 0.0),
        # Wanted 0.3 m/s and 2 rad/s (0.4 m/s); achieved the translation alone: 0.09/0.25.
        (0.3 * X + 2 * ROLL, 0.3 * X, 0.36, math.acos(0.6)),
    ],
)
def test_progress_and_off_course_by_hand(
    wanted: Array, achieved: Array, alpha: float, angle: float
) -> None:
    """Progress is <V_a, V>/|V|^2, off course the angle between the two, in the metric M."""
    got_alpha, got_angle = _both(wanted, achieved)
    assert got_alpha == pytest.approx(alpha)
    assert got_angle == pytest.approx(angle)


def test_the_length_decides_between_translation_and_rotation() -> None:
    """With M = I the same twists have another angle: acos(0.3 / |(0.3, 2)|)."""
    _, angle = _both(0.3 * X + 2 * ROLL, 0.3 * X, EQUAL)
    assert angle == pytest.approx(math.acos(0.3 / math.hypot(0.3, 2)))


@pytest.mark.parametrize("angle", [1e-12, 1e-8, 1e-4])
def test_small_angles_are_not_lost(angle: float) -> None:
    """The inverse cosine would return 0 for 1e-8 rad."""
    _, got = _both(X, math.cos(angle) * X + math.sin(angle) * Y)
    assert got == pytest.approx(angle, rel=1e-6)


@pytest.mark.parametrize("angle", [1e-8, 1e-4])
def test_angles_near_reversal_are_not_lost(angle: float) -> None:
    """Nor pi minus a little."""
    _, got = _both(X, -math.cos(angle) * X + math.sin(angle) * Y)
    assert math.pi - got == pytest.approx(angle, rel=1e-6)


def test_a_dwell_has_neither() -> None:
    """Where nothing is wanted there is no direction; just above the threshold there is one."""
    for wanted in (0 * X, 0.99 * DWELL_SPEED_M_S * X, 0.99 * DWELL_SPEED_M_S / 0.2 * ROLL):
        alpha, angle = _both(wanted, X)
        assert math.isnan(alpha)
        assert math.isnan(angle)
    alpha, angle = _both(1.01 * DWELL_SPEED_M_S * X, 1.01 * DWELL_SPEED_M_S * X)
    assert (alpha, angle) == pytest.approx((1.0, 0.0))


def test_standing_still_is_stopped_and_not_on_course() -> None:
    """No angle, but a progress of zero; just above the threshold there is an angle."""
    assert _both(X, 0 * X)[0] == 0.0
    assert math.isnan(_both(X, 0 * X)[1])
    assert math.isnan(_both(X, 0.99 * STANDSTILL_SPEED_SHARE * Y)[1])
    assert _both(X, 1.01 * STANDSTILL_SPEED_SHARE * Y)[1] == pytest.approx(math.pi / 2)


def test_each_step_stands_for_itself() -> None:
    """A dwell, a stop, a reversal and a good step in one array."""
    wanted, achieved = np.array([0 * X, X, X, X]), np.array([X, 0 * X, -X, X])
    assert progress(wanted, achieved, SPACE) == pytest.approx([np.nan, 0, -1, 1], nan_ok=True)
    assert off_course(wanted, achieved, SPACE) == pytest.approx(
        [np.nan, np.nan, np.pi, 0], nan_ok=True
    )


def test_no_steps_have_no_values() -> None:
    """Empty in, empty out."""
    nothing = np.empty((0, 6))
    assert progress(nothing, nothing, SPACE).shape == (0,)
    assert off_course(nothing, nothing, SPACE).shape == (0,)


@settings(deadline=None)
@given(wanted=twists, achieved=twists, scale=st.floats(0.1, 10))
def test_progress_and_off_course_agree(wanted: Array, achieved: Array, scale: float) -> None:
    """|V| alpha = |V_a| cos(angle); the angle does not depend on how fast, alpha does."""
    alpha, angle = _both(wanted, achieved)
    size, size_a = np.linalg.norm(SPACE * wanted), np.linalg.norm(SPACE * achieved)
    if math.isnan(angle) or min(size, size_a) < 1e-2:
        return
    assert 0 <= angle <= math.pi
    assert alpha * size == pytest.approx(size_a * math.cos(angle), rel=1e-9, abs=1e-9)
    faster_alpha, same_angle = _both(wanted, scale * achieved)
    assert faster_alpha == pytest.approx(scale * alpha, rel=1e-9, abs=1e-12)
    assert same_angle == pytest.approx(angle, rel=1e-6, abs=1e-9)
