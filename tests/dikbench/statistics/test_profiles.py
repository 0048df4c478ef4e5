"""Performance and data profiles: examples by hand and properties."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from dikbench.statistics.data_profile import data_profile
from dikbench.statistics.performance_profile import area, performance_ratios, profile

COSTS = arrays(
    float,
    st.tuples(st.integers(1, 8), st.integers(1, 5)),
    elements=st.one_of(st.floats(1e-3, 1e3), st.sampled_from([np.inf, np.nan])),
)
FACTORS = np.array([1.0, 1.5, 2.0, 5.0, 1e3, 1e9])

INF, NAN = np.inf, np.nan


def test_two_laws_on_three_problems() -> None:
    """By hand: each formulation wins once where both go, the second fails on the last problem."""
    costs = np.array([[1.0, 2.0], [3.0, 1.0], [2.0, INF]])
    ratios = performance_ratios(costs)
    np.testing.assert_array_equal(ratios, [[1.0, 2.0], [3.0, 1.0], [1.0, INF]])
    expected = [[2 / 3, 1 / 3], [2 / 3, 2 / 3], [1.0, 2 / 3], [1.0, 2 / 3]]
    np.testing.assert_allclose(profile(ratios, np.array([1.0, 2.0, 3.0, 1e9])), expected)


def test_the_area_is_the_integral_of_the_profile() -> None:
    """Over log tau, against the trapezoidal rule on a fine grid."""
    ratios = np.array([[1.0, 2.0], [3.0, 1.0], [1.0, INF], [70.0, 1.0]])
    grid = np.geomspace(1.0, 50.0, 100_001)
    heights = profile(ratios, grid)
    integral = np.trapezoid(heights, np.log(grid), axis=0) / np.log(50.0)
    np.testing.assert_allclose(area(ratios, 50.0), integral, atol=1e-4)


def test_the_order_of_two_laws_flips_when_the_best_is_taken_out() -> None:
    """Gould & Scott's phenomenon: within twice the best, B beats C beside A and loses without."""
    costs = np.array([[1.0, 2.0, 3.0], [1.0, 2.0, 3.0], [1.0, 9.0, 4.0]])
    at_two = np.array([2.0])
    _, b, c = profile(performance_ratios(costs), at_two)[0]
    assert (b, c) == (pytest.approx(2 / 3), 0.0)
    b, c = profile(performance_ratios(costs[:, 1:]), at_two)[0]
    assert (b, c) == (pytest.approx(2 / 3), 1.0)


@given(COSTS)
def test_a_profile_is_a_distribution_function(costs: np.ndarray) -> None:
    """It lies in [0, 1], never falls, and ends at the share of the problems that are solved."""
    heights = profile(performance_ratios(costs), FACTORS)
    assert ((heights >= 0.0) & (heights <= 1.0)).all()
    assert (np.diff(heights, axis=0) >= 0.0).all()
    np.testing.assert_allclose(heights[-1], np.isfinite(costs).mean(axis=0))


@given(COSTS)
def test_every_problem_that_is_solved_has_a_winner(costs: np.ndarray) -> None:
    """At tau = 1 the profiles add up to at least the share of the problems somebody solved."""
    heights = profile(performance_ratios(costs), np.array([1.0]))
    assert heights.sum() >= np.isfinite(costs).any(axis=1).mean() - 1e-12


@given(COSTS, st.integers(-20, 20))
def test_the_unit_of_a_problem_does_not_matter(costs: np.ndarray, power: int) -> None:
    """Each problem may be measured in a unit of its own."""
    units = 2.0 ** (power * np.arange(len(costs)))[:, None]
    np.testing.assert_array_equal(performance_ratios(units * costs), performance_ratios(costs))


def test_profiles_of_laws_that_all_failed_are_zero() -> None:
    """No problem solved is a height of 0, not an undefined one; one row and no row work too."""
    failed = performance_ratios(np.array([[INF, NAN], [NAN, INF]]))
    assert (failed == INF).all()
    assert (profile(failed, FACTORS) == 0.0).all()
    assert profile(performance_ratios(np.array([[4.0, 4.0]])), FACTORS).min() == 1.0
    assert np.isnan(profile(performance_ratios(np.empty((0, 2))), FACTORS)).all()
    assert profile(performance_ratios(np.empty((0, 2))), FACTORS).shape == (len(FACTORS), 2)


def test_a_data_profile_counts_what_is_below_each_target() -> None:
    """By hand; an error at the target is not below it, what failed never is."""
    errors = np.array([[1e-4, 1e-2], [1e-3, INF], [NAN, 0.0]])
    targets = np.array([1e-4, 2e-4, 1e-2, 1e-1])
    expected = [[0, 1 / 3], [1 / 3, 1 / 3], [2 / 3, 1 / 3], [2 / 3, 2 / 3]]
    np.testing.assert_allclose(data_profile(errors, targets), expected)
    assert np.isnan(data_profile(np.empty((0, 3)), targets)).all()


@given(COSTS, st.integers(0, 4))
def test_a_data_profile_depends_on_no_other_law(errors: np.ndarray, contender: int) -> None:
    """Unlike a performance profile; and it never falls."""
    targets = np.geomspace(1e-4, 1e4, 17)
    contender %= errors.shape[1]
    shares = data_profile(errors, targets)
    np.testing.assert_array_equal(
        shares[:, [contender]], data_profile(errors[:, [contender]], targets)
    )
    assert (np.diff(shares, axis=0) >= 0.0).all()
