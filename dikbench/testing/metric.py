"""The contract of metrics, as checks for the author of one.

    @pytest.mark.parametrize("check", dikbench.testing.METRIC_CHECKS)
    def test_contract(check):
        check(MY_METRIC)

or, without pytest, `check_metric(MY_METRIC)`. The motions are short: one follows its reference, one
stands still, one shakes.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from numbers import Real
from typing import Any, Final, NamedTuple

import numpy as np

from dikbench.errors import in_words
from dikbench.metrics.metric import Metric, unit_suffix
from dikbench.metrics.motion import Motion
from dikbench.metrics.motion_of_trace import motion_of, motions_of
from dikbench.metrics.plugged import misfit
from dikbench.testing.motions import moved, slow_line

Metrics = Metric | tuple[Metric, ...]
MetricCheck = Callable[[Metrics], None]


class _Measured(NamedTuple):
    label: str
    motion: Motion


def check_metric_declaration(metrics: Metrics) -> None:
    """Check that name, unit, direction, worst value and definition are what a table needs."""
    if wrong := misfit(metrics):
        raise AssertionError(f"it {wrong}")
    for metric in _each(metrics):
        suffix = unit_suffix(metric.unit)
        if suffix and not metric.name.endswith(f"_{suffix}"):
            raise AssertionError(
                f"{metric.name} has the unit {metric.unit}; valid: a name that ends with _{suffix}"
            )
        if not metric.definition.strip() or "\n" in metric.definition:
            raise AssertionError(f"{metric.name}: the definition is not one line")


def check_metric_value(metrics: Metrics) -> None:
    """Check that each motion gives a number, NaN where it defines none, and no error."""
    for metric, label, value in _values(metrics):
        if not isinstance(value, Real):
            raise AssertionError(
                f"{metric.name} of {label} is {value!r} ({type(value).__name__}); valid: a number"
            )


def check_metric_worst(metrics: Metrics) -> None:
    """Check that no motion gives a value worse than that of a failed trial."""
    for metric, label, value in _values(metrics):
        if not isinstance(value, int | float):
            continue
        worse = value > metric.worst if metric.best == "low" else value < metric.worst
        if worse:
            raise AssertionError(
                f"{metric.name} of {label} is {value}, worse than worst = {metric.worst}"
            )


def check_metric_inputs_untouched(metrics: Metrics) -> None:
    """Check that the record of the run stays as it is."""
    for label, motion in _motions():
        before = {name: np.array(part) for name, part in _arrays(motion).items()}
        for metric in _each(metrics):
            _of(metric, label, motion)
            for name, part in _arrays(motion).items():
                if not np.array_equal(before[name], part, equal_nan=part.dtype.kind == "f"):
                    raise AssertionError(f"{metric.name} changed trace.{name} of {label}")


def check_metric_repeatable(metrics: Metrics) -> None:
    """Check that the same motion gives the same value, whatever was measured before and with it."""
    motions = [*_motions()]
    together = motions_of(
        [motion.trace for _, motion in motions], slow_line(), [None] * len(motions)
    )
    for metric in _each(metrics):
        first = [_of(metric, *each) for each in motions]
        again = [_of(metric, *each) for each in reversed(motions)][::-1]
        beside = [_of(metric, m.label, other) for m, other in zip(motions, together, strict=True)]
        for (label, _), value, *others in zip(motions, first, again, beside, strict=True):
            for said, other in zip(("measured again", "measured with others"), others, strict=True):
                if value != other and not (math.isnan(value) and math.isnan(other)):
                    raise AssertionError(f"{metric.name} of {label}: {value}, {said} {other}")


def _each(metrics: Metrics) -> tuple[Metric, ...]:
    return metrics if isinstance(metrics, tuple) else (metrics,)


def _motions() -> Iterator[_Measured]:
    for label, scenario, run in moved():
        yield _Measured(label, motion_of(run.trace, scenario))


def _values(metrics: Metrics) -> Iterator[tuple[Metric, str, Any]]:
    for label, motion in _motions():
        for metric in _each(metrics):
            yield metric, label, _of(metric, label, motion)


def _of(metric: Metric, label: str, motion: Motion) -> Any:
    try:
        return metric.of(motion)
    except Exception as error:
        raise AssertionError(f"{metric.name} of {label}: raised {in_words(error)}") from error


def _arrays(motion: Motion) -> dict[str, Any]:
    trace = motion.trace
    names = [name for name in dir(trace) if not name.startswith("_")]
    parts = {name: getattr(trace, name) for name in names}
    return {name: part for name, part in parts.items() if isinstance(part, np.ndarray)}


METRIC_CHECKS: Final[tuple[MetricCheck, ...]] = (
    check_metric_declaration,
    check_metric_value,
    check_metric_worst,
    check_metric_inputs_untouched,
    check_metric_repeatable,
)
"""Every check of a metric, or of a tuple of some: (metrics) -> None."""


def check_metric(metrics: Metrics) -> None:
    """Run every check; the first one that fails raises `AssertionError`."""
    for check in METRIC_CHECKS:
        check(metrics)
