"""How much worse a metric may become: METRIC=VALUE, or METRIC=SHARE% of its value in A."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from dikbench.arrays import Array, Mask
from dikbench.errors import DikbenchError, unknown
from dikbench.metrics import METRICS


@dataclass(frozen=True)
class Tolerance:
    """A bound on how much worse a metric of a trial may be in B than in A.

    Attributes:
        metric: its name.
        bound: in the metric's unit, or as a share of its value in A.
        relative: which of the two.
    """

    metric: str
    bound: float
    relative: bool

    def exceeded(self, worsening: Array, a: Array) -> Mask:
        """Where a worsening (n,) goes beyond it, for values a (n,) in A."""
        scale = np.abs(a) if self.relative else np.ones_like(a)
        with np.errstate(invalid="ignore"):  # 0 times an infinite value
            allowed = np.nan_to_num(self.bound * scale, nan=0.0, posinf=np.inf)
        beyond: Mask = (worsening > allowed) | (worsening == np.inf)
        return beyond


def parse_tolerance(text: str) -> Tolerance:
    """Read `position_error_rms_m=1e-6` (in the metric's unit) or `position_error_rms_m=5%`.

    Raises:
        DikbenchError: if it is neither, or there is no such metric.
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
            "position_error_rms_m=1e-6 or position_error_rms_m=5%"
        )
    if name not in METRICS:
        raise unknown("metric", name, METRICS, f"in tolerance {text!r}", "dikbench list metrics")
    return Tolerance(name, bound, percent)
