"""Certificates: claims about a scenario's difficulty, measured on its reference and checked."""

from __future__ import annotations

from dataclasses import dataclass

from dikbench.errors import DikbenchError


@dataclass(frozen=True)
class Claim:
    """A measured quantity of a scenario and the range in which it must lie.

    Attributes:
        quantity: what was measured, with its unit.
        value: the measured value.
        at_least, at_most: the range of the value.
        remedy: what to change where it does not hold, for the message.
    """

    quantity: str
    value: float
    at_least: float = -float("inf")
    at_most: float = float("inf")
    remedy: str = ""

    @property
    def holds(self) -> bool:
        """Whether the value is in its range (NaN is in none)."""
        return self.at_least <= self.value <= self.at_most

    def __str__(self) -> str:
        """Write the claim as an inequality."""
        low = f"{self.at_least:.4g} <= " if self.at_least > -float("inf") else ""
        high = f" <= {self.at_most:.4g}" if self.at_most < float("inf") else ""
        return f"{low}{self.quantity} = {self.value:.4g}{high}"

    @property
    def failure(self) -> str:
        """The value and the range in which it should be."""
        low = f">= {self.at_least:.4g}" if self.at_least > -float("inf") else ""
        high = f"<= {self.at_most:.4g}" if self.at_most < float("inf") else ""
        valid = " and ".join(filter(None, (low, high))) or "a number"
        remedy = f" ({self.remedy})" if self.remedy else ""
        return f"{self.quantity} = {self.value:.4g}, must be {valid}{remedy}"


class CertificateFailed(DikbenchError):
    """A scenario is not what it claims to be.

    Attributes:
        failures: the claims that do not hold, with what would be valid.
    """

    def __init__(self, scenario: str, failures: str) -> None:
        super().__init__(f"certificate of {scenario!r} failed: {failures}")
        self.failures = failures


@dataclass(frozen=True)
class Certificate:
    """The claims of a scenario about its own difficulty."""

    claims: tuple[Claim, ...]

    def check(self, scenario: str) -> None:
        """Check every claim; the scenario's name is for the message.

        Raises:
            CertificateFailed: if a claim does not hold: the scenario would test something else.
        """
        failures = [claim.failure for claim in self.claims if not claim.holds]
        if failures:
            raise CertificateFailed(scenario, "; ".join(failures))
