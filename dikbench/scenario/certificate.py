"""Certificates: what makes a scenario hard, measured on its reference and asserted."""

from __future__ import annotations

from dataclasses import dataclass

from dikbench.errors import DikbenchError


@dataclass(frozen=True)
class Claim:
    """A measured property of a scenario and the range in which it must lie.

    Attributes:
        quantity: what was measured, with its unit.
        value: what came out.
        at_least, at_most: the range that makes the scenario what it says it is.
    """

    quantity: str
    value: float
    at_least: float = -float("inf")
    at_most: float = float("inf")

    @property
    def holds(self) -> bool:
        """Whether the value is in its range (NaN is in none)."""
        return self.at_least <= self.value <= self.at_most

    def __str__(self) -> str:
        """Write the claim as an inequality."""
        low = f"{self.at_least:.4g} <= " if self.at_least > -float("inf") else ""
        high = f" <= {self.at_most:.4g}" if self.at_most < float("inf") else ""
        return f"{low}{self.quantity} = {self.value:.4g}{high}"


@dataclass(frozen=True)
class Certificate:
    """The claims of a scenario about its own difficulty."""

    claims: tuple[Claim, ...]

    def check(self) -> None:
        """Assert every claim.

        Raises:
            DikbenchError: if one does not hold: the scenario would test something else.
        """
        for claim in self.claims:
            if not claim.holds:
                raise DikbenchError(f"certificate failed: {claim} is false")
