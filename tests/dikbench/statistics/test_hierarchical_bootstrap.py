"""Bootstrap intervals over levels: families, robots, scenarios and seeds."""

from __future__ import annotations

import numpy as np
import pytest
import scipy.stats

from dikbench.statistics.hierarchical_bootstrap import draw_weights, mean_intervals

FAMILIES, SCENARIOS, SEEDS = 12, 4, 3


def _balanced() -> tuple[list[int], list[tuple[int, int]]]:
    """The family and the scenario of each trial of a balanced study."""
    places = [(f, s) for f in range(FAMILIES) for s in range(SCENARIOS) for _ in range(SEEDS)]
    return [family for family, _ in places], places


def _studies(number: int) -> np.ndarray:
    """Columns of independent studies whose trials resemble those of their family; mean 0."""
    random = np.random.default_rng(7)
    family = random.normal(0.0, 1.0, (FAMILIES, 1, 1, number))
    scenario = random.normal(0.0, 0.7, (FAMILIES, SCENARIOS, 1, number))
    seed = random.normal(0.0, 0.3, (FAMILIES, SCENARIOS, SEEDS, number))
    return (family + scenario + seed).reshape(-1, number)


def _coverage(families: list[int], scenarios: list[tuple[int, int]]) -> float:
    """The share of 400 simulated studies whose interval holds the true mean."""
    low, high = mean_intervals(_studies(400), draw_weights(families, scenarios)).T
    return float(np.mean((low <= 0.0) & (high >= 0.0)))


def test_an_interval_covers_what_it_should() -> None:
    """Of 400 simulated studies of 12 families, between 85 and 99 % cover the truth."""
    assert 0.85 <= _coverage(*_balanced()) <= 0.99


def test_trials_taken_for_independent_would_cover_too_little() -> None:
    """Why the hierarchy: a flat bootstrap of the same studies covers less than 75 %."""
    _, scenarios = _balanced()
    assert _coverage(list(range(len(scenarios))), scenarios) < 0.75


def test_a_flat_sample_gives_the_percentile_interval_of_scipy() -> None:
    """One scenario's seeds are a flat sample, of which scipy knows the interval."""
    values = np.random.default_rng(1).lognormal(0.0, 1.0, 60)
    weights = draw_weights([0] * 60, [0] * 60, resamples=20_000)
    ours = mean_intervals(values[:, None], weights)[0]
    theirs = scipy.stats.bootstrap(
        (values,), np.mean, n_resamples=20_000, method="percentile", rng=2
    ).confidence_interval
    width = theirs.high - theirs.low
    np.testing.assert_allclose(ours, [theirs.low, theirs.high], atol=0.04 * width)


def test_weights_are_those_of_drawing_step_by_step() -> None:
    """Means and covariances of the weights of an unbalanced tree, against naive drawing."""
    families = ["a", "a", "a", "a", "b", "b", "c"]
    robots = ["a1", "a1", "a1", "a2", "b1", "b1", "c1"]
    scenarios = ["x", "x", "y", "z", "x", "x", "x"]
    tree = [[[[0, 1], [2]], [[3]]], [[[4, 5]]], [[[6]]]]
    random = np.random.default_rng(3)
    naive = np.zeros((10_000, 7))
    for weights in naive:
        for family in random.integers(3, size=3):
            of_family = tree[family]
            for robot in random.integers(len(of_family), size=len(of_family)):
                of_robot = of_family[robot]
                for scenario in random.integers(len(of_robot), size=len(of_robot)):
                    places = of_robot[scenario]
                    np.add.at(weights, random.choice(places, len(places)), 1.0)
    ours = draw_weights(families, robots, scenarios, resamples=20_000)
    np.testing.assert_allclose(ours.mean(axis=0), naive.mean(axis=0), atol=0.06)
    np.testing.assert_allclose(np.cov(ours.T), np.cov(naive.T), atol=0.2)


def test_the_same_seed_gives_the_same_interval() -> None:
    """A report of the same trials is the same report."""
    families, scenarios = _balanced()
    one, other = (draw_weights(families, scenarios) for _ in range(2))
    np.testing.assert_array_equal(one, other)
    assert (draw_weights(families, scenarios, seed=1) != one).any()


def test_nan_counts_nowhere() -> None:
    """The interval of a formulation with undefined trials is that of the study without them."""
    families, scenarios = _balanced()
    values = _studies(1)
    missing = np.arange(len(values)) % SEEDS == 0
    holed = np.where(missing[:, None], np.nan, values)
    weights = draw_weights(families, scenarios)
    got = mean_intervals(holed, weights)[0]
    kept = weights[:, ~missing]
    means = kept @ values[~missing, 0] / kept.sum(axis=1)
    np.testing.assert_allclose(got, np.quantile(means, (0.025, 0.975)))


@pytest.mark.parametrize(
    "values", [[1.0, 1.0, 1.0], [2.0, np.nan, np.nan], [np.nan] * 3, [0.0, 0.0, np.nan]]
)
def test_no_interval_where_no_spread_was_seen(values: list[float]) -> None:
    """Equal trials, a single one and none say nothing of how trials differ."""
    weights = draw_weights(["f", "f", "g"], ["s", "t", "u"])
    assert np.isnan(mean_intervals(np.array(values)[:, None], weights)).all()


def test_nothing_at_all_has_no_interval() -> None:
    """No trials, and no formulations, are no error."""
    weights = draw_weights([], [])
    assert np.isnan(mean_intervals(np.empty((0, 2)), weights)).all()
    assert mean_intervals(np.empty((0, 0)), weights).shape == (0, 2)
