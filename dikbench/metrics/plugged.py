"""Metrics of other authors: named by a study, and computed beside those that come with dikbench."""

from __future__ import annotations

import math
import re
from collections.abc import Iterable, Mapping
from typing import Any, Final, NamedTuple

from dikbench.errors import DikbenchError, in_words
from dikbench.metrics.every import METRICS
from dikbench.metrics.metric import Metric
from dikbench.metrics.motion import Motion, is_finite
from dikbench.plugins.source import digest_of_module
from dikbench.user_code import Pluggable

METRIC_ERRORS: Final = "metric_errors"
"""Key of a measured run, beside its metrics: why some have no value, by name."""

COLUMN: Final = re.compile(r"[a-z][a-z0-9_]*")

OF_SELECTORS: Final = ("formulation_", "solver_", "scenario_", "plant_")
"""What the columns of parameters of selectors begin with."""


class OtherMetric(NamedTuple):
    """A metric of another author.

    Attributes:
        metric: the metric.
        selector: how it is named.
        source: hash of its source.
    """

    metric: Metric
    selector: str
    source: str


def misfit(value: Any) -> str:
    """Say why something is no metric, to follow its name; an empty text where it is one."""
    metrics = value if isinstance(value, tuple) else (value,)
    if not metrics or not all(isinstance(metric, Metric) for metric in metrics):
        return "is neither a dikbench.metrics.Metric nor a tuple of some (series_metrics)"
    for metric in metrics:
        if metric.name in METRICS:
            return f"is called {metric.name!r}, as one of dikbench; valid: another name"
        if not COLUMN.fullmatch(metric.name) or metric.name.startswith(OF_SELECTORS):
            return (
                f"is called {metric.name!r}, which is no name of a column; valid: small letters, "
                f"digits and _, such as reversals_steps, not beginning with {OF_SELECTORS[0]} ..."
            )
        if metric.best not in ("low", "high") or not isinstance(metric.worst, int | float):
            told = f"has best = {metric.best!r}, worst = {metric.worst!r}"
            return f"{told}; valid: low or high, and a number"
        if not callable(metric.of):
            return f"has of = {metric.of!r}; valid: a function of a Motion"
    return ""


EVERY_METRIC: Final = Pluggable("metric", METRICS, misfit)
"""Where metrics are looked for."""


def other_metrics(names: Iterable[str]) -> tuple[OtherMetric, ...]:
    """Find the metrics of other authors by their selectors; those of dikbench are always there.

    Raises:
        DikbenchError: if a name is unknown, or two metrics have one name.
    """
    found: dict[str, OtherMetric] = {}
    for selector in dict.fromkeys(names):
        named = EVERY_METRIC.find(selector)
        if named is None:
            continue
        source = digest_of_module(named.module, named.file)
        for metric in named.value if isinstance(named.value, tuple) else (named.value,):
            other = OtherMetric(metric, selector, source)
            if found.setdefault(metric.name, other) is not other:
                raise DikbenchError(
                    f"two metrics are called {metric.name!r}: {found[metric.name].selector} and "
                    f"{selector}; valid: another name"
                )
    return tuple(found.values())


def described(others: Iterable[OtherMetric]) -> dict[str, dict[str, Any]]:
    """Describe metrics for those who read results without their code."""
    return {
        metric.name: {
            "selector": selector,
            "source": source,
            "unit": metric.unit,
            "best": metric.best,
            "worst": repr(float(metric.worst)),  # JSON has no infinity
            "definition": metric.definition,
        }
        for metric, selector, source in others
    }


def evaluate_others(motion: Motion, others: Iterable[OtherMetric]) -> dict[str, Any]:
    """Compute metrics of other authors; one that fails has no value, and its reason is returned."""
    found: dict[str, Any] = {}
    errors: dict[str, str] = {}
    finite = motion.whole is not None or is_finite(motion.trace)
    for metric, _, _ in others:
        try:
            found[metric.name] = float(metric.of(motion)) if finite else metric.worst
        except Exception as error:
            found[metric.name], errors[metric.name] = math.nan, in_words(error)
    return {**found, METRIC_ERRORS: errors} if errors else found


def take_errors(row: dict[str, Any], told: dict[str, str]) -> None:
    """Take the reasons out of a measured run and keep the first of each metric."""
    errors: Mapping[str, str] = row.pop(METRIC_ERRORS, {})
    for name, reason in errors.items():
        told.setdefault(name, reason)
