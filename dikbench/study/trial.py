"""A trial: one cell of the benchmark matrix, as text from which any process can build it."""

from __future__ import annotations

from dataclasses import dataclass

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
