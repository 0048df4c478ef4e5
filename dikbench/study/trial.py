"""A trial: one cell of the benchmark matrix, from which any process can build its parts."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

from dikbench.selector import Selector, parse_selector

NO_SOLVER: Final = Selector("none")
"""The solver of a formulation that needs none."""


@dataclass(frozen=True)
class Trial:
    """One cell: formulation x scenario x solver x plant x reference mode x seed.

    Attributes:
        formulation, scenario, solver, plant: their selectors; the solver is `NO_SOLVER` for a
            formulation that needs none.
        reference: `time` or `path`: what advances the reference.
        seed: seed of the scenario.
    """

    formulation: Selector
    scenario: Selector
    solver: Selector
    plant: Selector
    reference: str
    seed: int

    @classmethod
    def of(
        cls,
        formulation: str,
        scenario: str,
        solver: str = "none",
        plant: str = "ideal",
        reference: str = "time",
        seed: int = 0,
    ) -> Trial:
        """Build a trial from texts, as they stand in a row of results.

        Raises:
            DikbenchError: if a text is no selector.
        """
        return cls(
            parse_selector(formulation),
            parse_selector(scenario),
            parse_selector(solver),
            parse_selector(plant),
            reference,
            int(seed),
        )

    @property
    def row(self) -> dict[str, str | int]:
        """The columns of a table of results that identify the trial of a row."""
        return {
            "formulation": str(self.formulation),
            "solver": str(self.solver),
            "scenario": str(self.scenario),
            "plant": str(self.plant),
            "reference": self.reference,
            "seed": self.seed,
        }

    def __str__(self) -> str:
        """Name the trial in words."""
        solver = "" if self.solver == NO_SOLVER else f" with {self.solver}"
        how = f"{self.plant} plant, {self.reference}, seed {self.seed}"
        return f"{self.formulation}{solver} on {self.scenario} ({how})"
