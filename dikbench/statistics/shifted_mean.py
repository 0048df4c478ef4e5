"""The shifted geometric mean: an average of numbers that span orders of magnitude, and of zeros."""

from __future__ import annotations

import numpy as np

from dikbench.arrays import Array


def shifted_geometric_mean(values: Array, shift: float) -> float:
    """Compute exp(mean ln(x + s)) - s over the values that are not NaN; NaN without any.

    It treats x << s alike and averages the logarithms of x >> s: a shift far above the values makes
    an arithmetic mean of it, hence a shift near their median.

    Args:
        values: numbers x >= 0, or NaN.
        shift: s > 0, in the unit of x.

    Source: Achterberg 2007, Constraint Integer Programming (thesis, on averaging).
    """
    defined = values[~np.isnan(values)]
    if not len(defined):
        return float("nan")
    # Relative to the shift, so that a zero is a logarithm of one: exact.
    return float(shift * np.expm1(np.mean(np.log1p(defined / shift))))


def shift_near_median(values: Array) -> float:
    """Round the median to one significant digit, as a shift that a heading can state.

    Where more than half of the values are zero it is the median of the positive ones, and 1 where
    all are.

    Args:
        values: numbers >= 0; NaN and infinities are passed over.
    """
    finite = values[np.isfinite(values)]
    for candidates in (finite, finite[finite > 0]):
        middle = float(np.median(candidates)) if len(candidates) else 0.0
        if middle > 0:
            return float(f"{middle:.0e}")
    return 1.0
