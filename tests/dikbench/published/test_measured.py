"""Noise bands and verdicts on rows of published tables."""

from __future__ import annotations

from math import nan, sqrt

import numpy as np
import pytest

from dikbench.published.measured import (
    Measured,
    Statistic,
    of_count,
    of_mean,
    of_median,
    of_share,
    verdict,
)

STATISTICS = {
    "mean": Statistic("mean"),
    "most": Statistic("most", 0, extreme=True),
    "error": Statistic("error", significant=3),
}


@pytest.mark.parametrize(
    ("published", "measured", "said"),
    [
        ({"mean": 7.5}, {"mean": Measured(7.504, 7.4, 7.6)}, "equal"),
        ({"mean": 7.5}, {"mean": Measured(7.506, 7.4, 7.6)}, "inside noise"),
        ({"mean": 7.5}, {"mean": Measured(7.7, 7.6, 7.8)}, "not reproduced: mean"),
        ({"mean": 7.5, "most": 99}, {"mean": Measured(7.5, 7, 8), "most": Measured(98)},
         "inside noise"),
        ({"error": 0.0749}, {"error": Measured(0.07494)}, "equal"),
        ({"error": 0.0749}, {"error": Measured(0.0751)}, "not reproduced: error"),
        ({"mean": 1.0}, {"mean": Measured(nan)}, "not reproduced: mean"),
        ({}, {"mean": Measured(1.0)}, "ours"),
    ],
)  # fmt: skip
def test_verdicts(published: dict[str, float], measured: dict[str, Measured], said: str) -> None:
    """Equal as printed; inside the band; else named. The largest of a sample decides nothing."""
    assert verdict(STATISTICS, published, measured) == said


def test_a_share_has_the_binomial_deviation() -> None:
    """Two of sqrt(p (1 - p) / n), of both samples where they are two."""
    counted = np.arange(400) < 100
    alone, both = of_share(counted), of_share(counted, 100)
    assert alone.value == 25
    assert alone.high - alone.value == pytest.approx(200 * sqrt(0.25 * 0.75 / 400))
    assert both.high - both.value == pytest.approx(200 * sqrt(0.25 * 0.75 * (1 / 400 + 1 / 100)))
    count = of_count(counted)
    assert (count.value, count.high) == pytest.approx((100, 4 * alone.high))


def test_bands_hold_what_they_say() -> None:
    """Nineteen in twenty samples of a skew distribution have its mean and median in the band."""
    random = np.random.default_rng(0)
    samples = random.exponential(size=(400, 500))
    means = [of_mean(sample) for sample in samples]
    medians = [of_median(sample) for sample in samples]
    for bands, truth in ((means, 1.0), (medians, np.log(2))):
        inside = np.mean([band.low <= truth <= band.high for band in bands])
        assert 0.92 < inside < 0.985


def test_an_empty_sample_has_no_mean() -> None:
    """As where no target is reached."""
    assert np.isnan([of_mean(np.array([])).value, of_median(np.array([])).value]).all()
