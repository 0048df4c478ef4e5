"""Differences of metrics, B - A: per trial, and per formulation with intervals."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, Final

import numpy as np
import pandas as pd

from dikbench.arrays import Array
from dikbench.errors import DikbenchError
from dikbench.report.comparison.matching import Best, MatchedTrials
from dikbench.report.comparison.tolerances import Tolerance
from dikbench.results.columns import TRIAL
from dikbench.statistics.hierarchical_bootstrap import draw_weights, mean_intervals

GROUPS: Final = ["formulation", "solver", "plant", "reference"]
"""What has a row of its own; families, scenarios and seeds are averaged over."""

SMALL: Final = 1e-4
"""To sort by them, worsenings are put in relation to the value in A, but to no less than this [m,
rad, ...]: rounding on top of nothing is no regression to begin with."""

ROUNDING: Final = 1e-9
"""Values that differ by no more than this share of the larger one, or of `SMALL`, are the same."""


def difference(a: Array, b: Array) -> Array:
    """Compute B - A; NaN where one is undefined.

    It is 0 where both are the same infinity, both undefined, or the same but for rounding.
    """
    finite = np.isfinite(a) & np.isfinite(b)
    with np.errstate(invalid="ignore"):  # the same infinity twice
        apart = b - a
        scale = ROUNDING * np.maximum(np.maximum(np.abs(a), np.abs(b)), SMALL)
        same = (a == b) | (np.isnan(a) & np.isnan(b)) | (finite & (np.abs(apart) <= scale))
    return np.where(same, 0.0, apart)


def worsening(best: Best, a: Array, b: Array) -> Array:
    """How much worse B is than A, negative where it is better, by what is best of a metric.

    Infinite where B is no longer defined; 0 where only A was not.
    """
    sign = 1.0 if best == "low" else -1.0
    worse = sign * difference(a, b)
    return np.where(np.isnan(worse), np.where(np.isnan(b), np.inf, 0.0), worse)


def trial_differences(matched: MatchedTrials) -> pd.DataFrame:
    """A row per metric that differs and trial that ended well in both, the worst first.

    Returns:
        The columns of `TRIAL`, `metric`, `a`, `b`, `difference` (B - A), `worsening`.
    """
    columns = [*TRIAL, "metric", "a", "b", "difference", "worsening"]
    frames, severities = [pd.DataFrame(columns=columns)], [np.empty(0)]
    for metric, (a, b) in _values(matched).items():
        apart, worse = difference(a, b), worsening(matched.metrics[metric], a, b)
        changed = apart != 0
        frames.append(
            _trials(matched)
            .loc[changed, TRIAL]
            .assign(
                metric=metric,
                a=a[changed],
                b=b[changed],
                difference=apart[changed],
                worsening=worse[changed],
            )
        )
        severities.append(_severity(worse, a, b)[changed])
    order = np.argsort(-np.concatenate(severities), kind="stable")
    return pd.concat([frame for frame in frames if len(frame)] or frames).iloc[order]


def formulation_differences(
    matched: MatchedTrials, tolerances: Sequence[Tolerance] = ()
) -> pd.DataFrame:
    """Return a row per formulation and metric that differs in any trial, regressions first.

    First come rows with a trial beyond a tolerance, then the others; among each, those with the
    largest worsening of a trial in relation to its value in A, and last those without any.

    Returns:
        The columns of `GROUPS`, and
        metric: its name;
        trials: how many ended well in both;
        beyond, worse, better: how many of them are beyond a tolerance, became worse, better;
        mean_a: mean in A, over the trials at which both are finite;
        mean_difference: mean of B - A over them;
        low, high: its 95 % interval, by a bootstrap over families, scenarios and seeds;
        worst_difference: B - A in the trial that became worst;
        scenario, seed: of that trial.

    Raises:
        DikbenchError: if a tolerance is on a metric that one of the folders lacks.
    """
    for tolerance in tolerances:
        if tolerance.metric not in matched.metrics:
            raise DikbenchError(
                f"tolerance on {tolerance.metric}: one of the folders lacks this metric; both have "
                f"{', '.join(matched.metrics)}"
            )
    trials, values = _trials(matched), _values(matched)
    rows = []
    groups: Any = trials.groupby(GROUPS, sort=False).indices
    for group, places in groups.items():
        here = {metric: (a[places], b[places]) for metric, (a, b) in values.items()}
        changed = {m: (a, b) for m, (a, b) in here.items() if (difference(a, b) != 0).any()}
        if changed:
            named = dict(zip(GROUPS, group, strict=True))
            rows += [
                {**named, **row}
                for row in _rows(trials.iloc[places], changed, matched.metrics, tolerances)
            ]
    if not rows:
        return pd.DataFrame()
    table = pd.DataFrame(rows)
    order = np.lexsort((-table["severity"], table["beyond"] == 0))
    return table.iloc[order].drop(columns="severity").reset_index(drop=True)


def _rows(
    trials: pd.DataFrame,
    changed: dict[str, tuple[Array, Array]],
    best: Mapping[str, Best],
    tolerances: Sequence[Tolerance],
) -> list[dict[str, Any]]:
    """Return the rows of one formulation: per metric that changed its values in A and B, (n,)."""
    weights = draw_weights(list(trials["scenario_family"]), list(trials["scenario"]))
    finite = {}
    for metric, (a, b) in changed.items():
        apart = difference(a, b)
        finite[metric] = np.where(np.isfinite(a) & np.isfinite(apart), apart, np.nan)
    intervals = mean_intervals(np.column_stack(list(finite.values())), weights)
    rows = []
    for (metric, (a, b)), interval in zip(changed.items(), intervals, strict=True):
        worse = worsening(best[metric], a, b)
        beyond = [t.exceeded(worse, a) for t in tolerances if t.metric == metric]
        worst = int(np.argmax(worse))
        defined = ~np.isnan(finite[metric])
        rows.append(
            {
                "metric": metric,
                "trials": len(a),
                "beyond": int(np.any(beyond, axis=0).sum()),
                "worse": int((worse > 0).sum()),
                "better": int((worse < 0).sum()),
                "mean_a": a[defined].mean() if defined.any() else np.nan,
                "mean_difference": finite[metric][defined].mean() if defined.any() else np.nan,
                "low": interval[0],
                "high": interval[1],
                "worst_difference": difference(a, b)[worst],
                "scenario": trials["scenario"].iloc[worst],
                "seed": trials["seed"].iloc[worst],
                "severity": _severity(worse, a, b).max(),
            }
        )
    return rows


def _trials(matched: MatchedTrials) -> pd.DataFrame:
    """Return the trials that ended well in both."""
    return matched.a.loc[matched.both_ok, [*TRIAL, "scenario_family"]]


def _values(matched: MatchedTrials) -> dict[str, tuple[Array, Array]]:
    """Each metric of them in A and in B."""
    a, b = matched.a[matched.both_ok], matched.b[matched.both_ok]
    return {m: (a[m].to_numpy(float), b[m].to_numpy(float)) for m in matched.metrics}


def _severity(worse: Array, a: Array, b: Array) -> Array:
    """Put a worsening in relation to the value in A.

    A metric that B does not define comes after every number that became worse: it follows from
    what happened to the trial and does not say it.
    """
    share = worse / np.maximum(np.where(np.isfinite(a), np.abs(a), 0.0), SMALL)
    return np.where(np.isnan(b) & (worse > 0), np.finfo(float).tiny, share)
