"""A trial: one cell of the benchmark matrix, as text from which any process can build it."""

from __future__ import annotations

import hashlib
import json
from dataclasses import asdict, dataclass

NO_SOLVER = "none"
"""What stands in the place of the solver of a law that needs none."""


@dataclass(frozen=True)
class Trial:
    """One cell: formulation x scenario x solver x plant x reference mode x seed.

    Attributes:
        formulation, scenario, solver: selectors as they were given; the solver is `NO_SOLVER`
            for a law that needs none.
        plant: `ideal` or `saturating`.
        reference: `time` or `path`.
        seed: of the scenario.
    """

    formulation: str
    scenario: str
    solver: str
    plant: str
    reference: str
    seed: int

    @property
    def id(self) -> str:
        """A name made of what the trial is made of."""
        text = json.dumps(asdict(self), sort_keys=True)
        return hashlib.blake2b(text.encode(), digest_size=8).hexdigest()
