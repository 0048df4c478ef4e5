"""The metrics of a series that an author makes, with nothing but the door of the room."""

from __future__ import annotations

import math
from typing import Any, cast

import numpy as np
import pytest

from dikbench.arrays import Array
from dikbench.metrics import REDUCTIONS, Metric, Motion, series_metrics


def motion_at(heights: list[float]) -> Motion:
    """A motion of which nothing is known but the heights of the task frame [m]."""
    nothing = cast(Any, None)
    translations = np.array([[0.0, 0.0, height] for height in heights]).reshape(-1, 3)
    return Motion(nothing, nothing, translations, nothing, nothing, nothing, nothing, nothing)


def height(motion: Motion) -> Array:
    """Return the height of the task frame, (n + 1,) [m]."""
    heights: Array = motion.translations[:, 2]
    return heights


def by_name(*metrics: Metric) -> dict[str, Metric]:
    """The metrics by their names, in their order."""
    return {metric.name: metric for metric in metrics}


VALUES = by_name(
    *series_metrics(
        "height", "m/s^2", "height", height, "final", "rms", "p95", "max", "min", "mean"
    )
)
STEPS = by_name(
    *series_metrics("high", "m", "above 2.5 m", lambda m: height(m) > 2.5, "share", "steps")
)


@pytest.mark.parametrize(
    ("name", "value", "definition"),
    [
        ("height_final_m_s2", 2.0, "final height"),
        ("height_rms_m_s2", math.sqrt((1 + 9 + 16 + 4) / 4), "root mean square height"),
        # 0.95 of 3 intervals between 1, 2, 3, 4: at 2.85 of them.
        ("height_p95_m_s2", 3.85, "95 % quantile of the height"),
        ("height_max_m_s2", 4.0, "largest height"),
        ("height_min_m_s2", 1.0, "smallest height"),
        ("height_mean_m_s2", 2.5, "mean height"),
        ("high_share", 0.5, "share of the steps above 2.5 m"),
        ("high_steps", 2.0, "number of steps above 2.5 m"),
    ],
)
def test_every_reduction_of_a_series(name: str, value: float, definition: str) -> None:
    """Heights of 1, 3, 4, 2 m: name, definition, value; a share and a number have no unit."""
    metric = (VALUES | STEPS)[name]
    assert metric.of(motion_at([1.0, 3.0, 4.0, 2.0])) == pytest.approx(value)
    assert metric.definition == definition
    assert metric.unit == ("m/s^2" if name in VALUES else "")


def test_no_reduction_is_left_out_of_the_test_above() -> None:
    """And the metrics stand in the order in which they are asked for."""
    assert [name.split("_")[1] for name in VALUES | STEPS] == [
        "final", "rms", "p95", "max", "min", "mean", "share", "steps",
    ]  # fmt: skip
    assert {name.split("_")[1] for name in VALUES | STEPS} == set(REDUCTIONS)


def test_nothing_has_no_value() -> None:
    """NaN of a series without values; no step of none counts."""
    nothing = motion_at([])
    assert all(math.isnan(metric.of(nothing)) for metric in VALUES.values())
    assert math.isnan(STEPS["high_share"].of(nothing))
    assert STEPS["high_steps"].of(nothing) == 0.0


def test_the_extremes_are_those_of_the_values_that_are_defined() -> None:
    """A NaN among them is passed over by the largest and the smallest, by no other."""
    values = {name: metric.of(motion_at([1.0, math.nan, 2.0])) for name, metric in VALUES.items()}
    assert values["height_max_m_s2"] == 2.0
    assert values["height_min_m_s2"] == 1.0
    assert math.isnan(values["height_mean_m_s2"])


@pytest.mark.parametrize(
    ("best", "share", "other"), [("low", 1.0, math.inf), ("high", 0.0, -math.inf)]
)
def test_the_worst_value_follows_from_the_direction(best: Any, share: float, other: float) -> None:
    """All steps or none for a share, infinity for the rest, unless the author knows better."""
    made = series_metrics("x", "", "x", height, "share", "max", "steps", best=best)
    assert [metric.worst for metric in made] == [share, other, other]
    assert {metric.best for metric in made} == {best}
    known = series_metrics("x", "rad", "x", height, "max", best=best, worst=0.0, source="[Me2026]")
    assert [(metric.worst, metric.source) for metric in known] == [(0.0, "[Me2026]")]
