"""How much worse B may be: METRIC=VALUE, METRIC=SHARE%, success=SHARE%, TIME=SHARE%."""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass
from typing import Final

import numpy as np

from dikbench.arrays import Array, Mask
from dikbench.errors import DikbenchError, unknown
from dikbench.metrics import METRICS
from dikbench.report.comparison.times import COMPARED

SUCCESS: Final = "success"
"""The name under which the rate of success has a tolerance."""


@dataclass(frozen=True)
class Tolerance:
    """A bound on how much worse B may be than A.

    Attributes:
        metric: a metric, of any trial; `success`, the rate of success of any formulation; or a
            column of times, the ratio B / A of any formulation.
        bound: in the metric's unit, or as a share of its value in A; the share of all trials by
            which success may fall; the share by which a ratio of times may exceed one.
        relative: whether the bound is a share of the value in A.
    """

    metric: str
    bound: float
    relative: bool

    def exceeded(self, worsening: Array, a: Array) -> Mask:
        """Say where a worsening (n,) goes beyond it, for values a (n,) in A."""
        scale = np.abs(a) if self.relative else np.ones_like(a)
        with np.errstate(invalid="ignore"):  # 0 times an infinite value
            allowed = np.nan_to_num(self.bound * scale, nan=0.0, posinf=np.inf)
        beyond: Mask = (worsening > allowed) | (worsening == np.inf)
        return beyond


def parse_tolerance(text: str, others: Iterable[str] = ()) -> Tolerance:
    """Read `position_error_rms_m=1e-6` (in the metric's unit), `position_error_rms_m=5%`.

    `success=2%` (or 0.02) is in points of the rate of success; times are given in percent of their
    value in A only.

    Args:
        text: the tolerance.
        others: metrics of other authors that may be named.

    Raises:
        DikbenchError: if it is none of them, or there is no such metric.
    """
    name, equals, value = (part.strip() for part in text.partition("="))
    number, percent = value.removesuffix("%"), value.endswith("%")
    try:
        bound = float(number) / (100 if percent else 1)
    except ValueError:
        bound = math.nan
    if not equals or not bound >= 0 or math.isinf(bound):
        raise DikbenchError(
            f"tolerance {text!r} is not of the form METRIC=VALUE or METRIC=SHARE%, such as "
            "position_error_rms_m=1e-6, position_error_rms_m=5%, success=2% or "
            f"{COMPARED[0]}=20%"
        )
    if name == SUCCESS and bound > 1:
        raise DikbenchError(
            f"tolerance {text!r}: a rate of success cannot fall by more than 100 %; valid: points, "
            f"such as {SUCCESS}=2%"
        )
    if name in COMPARED and not percent:
        raise DikbenchError(
            f"tolerance {text!r}: times are compared as ratios, on whatever machine; give a share "
            f"of the time in A, such as {name}=20%"
        )
    known = [*METRICS, *others, SUCCESS, *COMPARED]
    if name not in known:
        raise unknown("metric", name, known, f"in tolerance {text!r}", "dikbench list metrics")
    return Tolerance(name, bound, percent and name != SUCCESS)
