"""The shifted geometric mean and its shift: closed forms and properties."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from dikbench.statistics.shifted_mean import shift_near_median, shifted_geometric_mean

NUMBERS = st.lists(st.floats(0.0, 1e6), min_size=1, max_size=30)
SHIFTS = st.floats(1e-6, 1e6)


def test_a_vanishing_shift_gives_the_geometric_mean() -> None:
    """Of 1, 10 and 100 it is 10."""
    assert shifted_geometric_mean(np.array([1.0, 10.0, 100.0]), 1e-12) == pytest.approx(10.0)


def test_it_is_the_formula() -> None:
    """Of 1 and 7 shifted by 1: sqrt(2 * 8) - 1 = 3; a zero has the logarithm of the shift."""
    assert shifted_geometric_mean(np.array([1.0, 7.0]), 1.0) == pytest.approx(3.0, rel=1e-15)
    assert shifted_geometric_mean(np.array([0.0, 3.0]), 1.0) == pytest.approx(1.0, rel=1e-15)


def test_a_huge_shift_gives_the_arithmetic_mean() -> None:
    """What a shift of 10 s does to times of 50 us, and why the shift is near the median."""
    times = np.array([20e-6, 50e-6, 800e-6])
    assert shifted_geometric_mean(times, 10.0) == pytest.approx(times.mean(), rel=1e-4)
    geometric = math.prod(times) ** (1 / 3)
    assert shifted_geometric_mean(times, 5e-5) < 0.6 * times.mean()
    assert shifted_geometric_mean(times, 5e-5) > geometric


def test_what_is_nan_counts_nowhere() -> None:
    """NaN is passed over; of nothing the mean is NaN; a single number is its own mean."""
    assert shifted_geometric_mean(np.array([np.nan, 1.0, 7.0]), 1.0) == pytest.approx(3.0)
    assert math.isnan(shifted_geometric_mean(np.array([]), 1.0))
    assert math.isnan(shifted_geometric_mean(np.array([np.nan]), 1.0))
    assert shifted_geometric_mean(np.array([0.25]), 3.0) == pytest.approx(0.25, rel=1e-14)


@given(NUMBERS, SHIFTS)
def test_it_lies_between_the_least_and_the_largest(values: list[float], shift: float) -> None:
    """And never above the arithmetic mean."""
    mean = shifted_geometric_mean(np.array(values), shift)
    slack = 1e-12 * (max(values) + shift)
    assert min(values) - slack <= mean <= np.mean(values) + slack


@given(NUMBERS, SHIFTS, st.floats(1e-3, 1e3))
def test_it_scales_with_its_unit(values: list[float], shift: float, factor: float) -> None:
    """In millimetres it is a thousand times that in metres, if the shift is too."""
    mean = shifted_geometric_mean(np.array(values), shift)
    scaled = shifted_geometric_mean(factor * np.array(values), factor * shift)
    assert scaled == pytest.approx(factor * mean, rel=1e-9, abs=1e-12 * factor * shift)


@given(NUMBERS, SHIFTS, st.randoms())
def test_it_knows_no_order(values: list[float], shift: float, random: object) -> None:
    """It is the same for the values in another order, and rises where a value rises."""
    mean = shifted_geometric_mean(np.array(values), shift)
    shuffled = list(values)
    random.shuffle(shuffled)  # type: ignore[attr-defined]
    assert shifted_geometric_mean(np.array(shuffled), shift) == pytest.approx(mean, rel=1e-9)
    raised = [values[0] + 1.0 + shift, *values[1:]]
    assert shifted_geometric_mean(np.array(raised), shift) > mean


@pytest.mark.parametrize(
    ("values", "shift"),
    [
        ([0.0123, 0.0144, 5.0], 0.01),
        ([47.1, 47.1], 50.0),
        ([0.0, 0.0, 0.0, 0.0, 0.3, 0.5, 90.0], 0.5),  # mostly zero: of the positive ones
        ([0.0, 0.0], 1.0),
        ([], 1.0),
        ([np.nan, np.inf, 2.2], 2.0),
    ],
)
def test_the_shift_is_the_median_to_one_digit(values: list[float], shift: float) -> None:
    """A round number near the median, positive whatever the values."""
    assert shift_near_median(np.array(values)) == shift
