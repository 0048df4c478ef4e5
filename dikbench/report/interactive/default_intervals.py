"""The bootstrapped intervals of the view that is shown first."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
import pandas as pd

from dikbench.report.interactive.controls import Control, rows_at_first
from dikbench.statistics.success import ROUNDING, paired_means, rates


def default_intervals(rows: pd.DataFrame, controls: Sequence[Control]) -> list[dict[str, Any]]:
    """Bootstrap how far each law is behind the best in the first view (see `statistics.success`).

    Views that are filtered have a closed form instead, which takes scenarios as independent.

    Args:
        rows: of the page (see `page_rows`).
        controls: of it.

    Returns:
        contender, drawn_lower and drawn_upper: the paired 95 % interval of its difference to the
        best of those that ran every case, of equally good ones the first in the alphabet.
    """
    found = rows_at_first(rows, controls)
    if found.empty:
        return []
    found = found.sort_values("contender", kind="stable").assign(
        formulation=found["contender"], solver="", scenario_family=found["family"]
    )
    done = found["outcomes"].str[0].eq("0").to_numpy()
    success = rates(found, done)
    rate = np.where(success.whole, success.rate, -1.0)
    best = int(np.argmax(rate >= rate.max() - ROUNDING))
    matrix = success.layout.fill(done.astype(float))
    _, lower, upper = paired_means(matrix - matrix[:, [best]], success)
    return [
        {"contender": law, "drawn_lower": low, "drawn_upper": high}
        for law, low, high in zip(
            success.contenders["formulation"], lower.tolist(), upper.tolist(), strict=True
        )
        if np.isfinite([low, high]).all()
    ]
