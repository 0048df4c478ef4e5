"""Who leads when a robot or a family is left out: a lead that hangs on one of them is none."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Final

import numpy as np
import pandas as pd

from dikbench.arrays import Array, Mask
from dikbench.statistics.success import (
    ROUNDING,
    Rates,
    case_facts,
    hierarchical_weights,
    succeeded,
    weighted_means,
)

KINDS: Final = {"robot": "robot", "scenario_family": "family"}
"""What is left out, one after the other: columns, and what they are called."""


@dataclass(frozen=True, eq=False)
class WithoutOne:
    """The rates of success without one robot or one family.

    Attributes:
        kind: "robot" or "family".
        name: which is left out.
        cases: number of cases that are left.
        scenarios: number of their scenarios.
        rate: the rate of each formulation over them, (k,).
    """

    kind: str
    name: str
    cases: int
    scenarios: int
    rate: Array

    def leaders(self, among: Mask) -> Mask:
        """Say who of some has the highest rate, ties together; nobody where nobody succeeds."""
        most = float(np.where(among, self.rate, 0.0).max(initial=0.0))
        return among & (self.rate >= most - ROUNDING) & (self.rate > 0)


def without_each(part: pd.DataFrame, found: Rates) -> Iterator[WithoutOne]:
    """Compute the rates again without each robot, then without each family, if others are left.

    Args:
        part: the rows of a situation that count.
        found: their rates of success.
    """
    layout = found.layout
    done = layout.fill(succeeded(part).astype(float))
    cases = case_facts(part, layout)
    for column, kind in KINDS.items():
        for name in sorted(cases[column].unique()):
            kept = cases[column].ne(name).to_numpy()
            left = cases[kept].reset_index(drop=True)
            if len(left):
                rate = weighted_means(done[kept], hierarchical_weights(left))
                yield WithoutOne(kind, str(name), len(left), left["scenario"].nunique(), rate)
