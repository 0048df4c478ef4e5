"""The identity of a row of a store."""

from __future__ import annotations

from dataclasses import dataclass

from dikbench.study.trial import Trial


@dataclass(frozen=True)
class StoredTrial:
    """The identity of a row.

    Attributes:
        id: see `trial_id`.
        trial: the cell.
        steps: number of its control steps.
        status: how it ended, by its name.
    """

    id: str
    trial: Trial
    steps: int
    status: str
