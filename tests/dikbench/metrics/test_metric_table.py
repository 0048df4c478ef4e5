"""What the table of metrics says of each of them: direction, worst value, unit."""

from __future__ import annotations

import math

import pytest
from makers.tip_motions import four_steps

from dikbench.metrics import METRICS


@pytest.mark.parametrize("name", METRICS)
def test_metrics_say_what_they_are(name: str) -> None:
    """A direction, a worst value on its side, one line."""
    metric = METRICS[name]
    assert metric.name == name
    assert "\n" not in metric.definition
    value = four_steps()[name]
    sign = 1 if metric.best == "low" else -1
    assert math.isnan(value) or sign * metric.worst >= sign * value


UNITS = {
    "_m": {"m"}, "_rad": {"rad"}, "_rad_s": {"rad/s", "rad s"}, "_rad_s2": {"rad/s^2"},
    "_s": {"s"}, "_per_s": {"1/s"}, "": {""},
}  # fmt: skip
"""What the ends of names say of units."""


@pytest.mark.parametrize("name", METRICS)
def test_the_unit_of_a_metric_is_that_at_the_end_of_its_name(name: str) -> None:
    """None where the name ends without one; the longest end counts: `_rad_s`, not `_s`."""
    end = max((suffix for suffix in UNITS if name.endswith(suffix)), key=len)
    assert METRICS[name].unit in UNITS[end]


@pytest.mark.parametrize("quantity", ["position", "velocity", "acceleration"])
def test_the_unit_of_a_time_integral_is_a_second_more(quantity: str) -> None:
    """Of `rad/s` it is `rad`."""
    units = {
        kind: metric.unit
        for kind in ("max", "integral")
        for name, metric in METRICS.items()
        if name.startswith(f"{quantity}_violation_{kind}")
    }
    times_second = {"rad": "rad s", "rad/s": "rad", "rad/s^2": "rad/s"}
    assert units["integral"] == times_second[units["max"]]
