"""The contract of families: every registered one keeps it, and lying ones are caught."""

from __future__ import annotations

import sys
from collections.abc import Callable
from dataclasses import dataclass, replace
from math import nan
from pathlib import Path
from typing import Annotated, Any, ClassVar, Literal

import numpy as np
import pytest
from makers.scenarios import scenario_of

from dikbench.parameters import Parameter
from dikbench.plugins.building import make_family
from dikbench.plugins.finding import plugins
from dikbench.scenario import Case, Claim, Family, Perturbation, Range, Robot, Scenario, Variation
from dikbench.testing import FAMILY_CHECKS, FamilyCheck, check_family, parameters
from dikbench.testing.family import (
    check_family_certificate,
    check_family_deterministic,
    check_family_parts,
    check_family_picklable,
    check_family_ranges,
    check_family_seeds,
)
from scenarios.reach import Reach

TRIANGLE = Path(__file__).parents[1] / "data" / "triangle.csv"
REQUIRED = {"csv": f"[file={TRIANGLE}]"}
"""What a family cannot do without."""

LOOK_ONLY = (check_family_certificate, check_family_parts, check_family_seeds)
"""Checks that make no scenario again, for which one of each seed is enough."""

MAKE_AGAIN = (check_family_deterministic, check_family_picklable)
"""Checks that compare two scenarios of one seed, the first of which may be known already."""

FAMILIES = [*plugins("scenario")]


@pytest.mark.parametrize("check", FAMILY_CHECKS, ids=lambda check: check.__name__)
@pytest.mark.parametrize("name", FAMILIES)
def test_registered_family_keeps_the_contract(
    monkeypatch: pytest.MonkeyPatch, name: str, check: FamilyCheck
) -> None:
    """Every registered family keeps every clause of the contract; an end of each range in turns."""
    selector, module = name + REQUIRED.get(name, ""), sys.modules[check.__module__]
    known = {1} if check in MAKE_AGAIN else set()
    turn, every_end = FAMILIES.index(name), parameters.ends

    def made(family: Family, seed: int) -> Scenario:
        if check in LOOK_ONLY or seed in known:
            known.discard(seed)
            return scenario_of(selector, seed)
        return family.scenario(seed)

    monkeypatch.setattr(module, "_scenario", made)

    def one_end(of: Parameter) -> list[float]:
        ends = every_end(of)
        return [ends[turn % len(ends)]] if ends else []

    monkeypatch.setattr(parameters, "ends", one_end)
    check(make_family(selector))


@pytest.mark.long
@pytest.mark.parametrize("name", FAMILIES)
def test_every_end_of_every_range_gives_a_scenario_or_says_why_not(name: str) -> None:
    """The low and the high one of all parameters, and the bounds in which they are drawn."""
    check_family_ranges(make_family(name + REQUIRED.get(name, "")))


@dataclass(frozen=True, kw_only=True)
class Honest(Reach):
    """A family that keeps the contract; the lying ones are made of it."""

    robot: str = "planar3r"


@dataclass(frozen=True, kw_only=True)
class NoRange(Honest):
    """Has a number that may be anything."""

    stretch: float = 1.0


@dataclass(frozen=True)
class Lax(Range):
    """A range that refuses nothing."""

    def check(self, name: str, value: Any) -> None:
        """See `Range`."""


@dataclass(frozen=True, kw_only=True)
class AcceptsAnything(Honest):
    """Takes a number that its range does not hold."""

    depth: Annotated[float, Lax(0.0, 0.3, "m")] = 0.1


@dataclass(frozen=True, kw_only=True)
class BreaksAtAnEnd(Honest):
    """Divides by a number that its range allows to be 0."""

    slowness: Annotated[float, Range(0.0, 1.0)] = 0.5

    def case(self, robot: Robot, change: Perturbation) -> Case:
        """See `Family`."""
        v0 = np.zeros(robot.nv) + 0.0 * (1 / self.slowness)
        return replace(super().case(robot, change), v0=v0)


@dataclass(frozen=True, kw_only=True)
class ClaimsNothing(Honest):
    """Certifies nothing."""

    def case(self, robot: Robot, change: Perturbation) -> Case:
        """See `Family`."""
        return replace(super().case(robot, change), claims=())


@dataclass(frozen=True, kw_only=True)
class ClaimsTooMuch(Honest):
    """Is certified for its first seed alone."""

    def case(self, robot: Robot, change: Perturbation) -> Case:
        """See `Family`."""
        return replace(super().case(robot, change), claims=(Claim("seed", change.seed, 0, 0),))


@dataclass(frozen=True, kw_only=True)
class ChecksNothing(Honest):
    """Makes scenarios past its own certificate."""

    def scenario(self, seed: int = 0) -> Scenario:
        """See `Family`."""
        made = super().scenario(seed)
        certificate = replace(made.certificate, claims=(Claim("x", nan),))
        return replace(made, certificate=certificate)


@dataclass(frozen=True, kw_only=True)
class StartsNowhere(Honest):
    """Starts with a joint at NaN."""

    def scenario(self, seed: int = 0) -> Scenario:
        """See `Family`."""
        made = super().scenario(seed)
        return replace(made, q0=np.array([nan, 0.0, 0.0]))


@dataclass(frozen=True, kw_only=True)
class VariesInSecret(Honest):
    """Perturbs what it does not declare."""

    variation: ClassVar[Variation] = Variation()

    def case(self, robot: Robot, change: Perturbation) -> Case:
        """See `Family`."""
        return super().case(robot, Perturbation(Variation(start=1e-3), change.seed))


@dataclass(frozen=True, kw_only=True)
class StandsStill(Honest):
    """Declares a variation, and has none."""

    def scenario(self, seed: int = 0) -> Scenario:
        """See `Family`."""
        return super().scenario(0 if seed > 0 else seed)


@dataclass(frozen=True, kw_only=True)
class TakesNegativeSeeds(Honest):
    """Takes the seed without its sign."""

    def scenario(self, seed: int = 0) -> Scenario:
        """See `Family`."""
        return super().scenario(abs(seed))


@dataclass(frozen=True, kw_only=True)
class ThrowsDice(Honest):
    """Starts anywhere."""

    def case(self, robot: Robot, change: Perturbation) -> Case:
        """See `Family`."""
        thrown = int(np.random.default_rng().integers(1, 2**62))
        return super().case(robot, Perturbation(Variation(start=1e-3), thrown))


@dataclass(frozen=True, kw_only=True)
class HoldsLambda(Honest):
    """Has a parameter that cannot be pickled."""

    shape: Callable[[float], float] = lambda tau: tau


@dataclass(frozen=True, kw_only=True)
class DrawsNothing(Honest):
    """Names a parameter that it has not."""

    grid = ("distance", "speed")


@dataclass(frozen=True, kw_only=True)
class Raises(Honest):
    """Fails for one robot in its own words."""

    robot: Literal["planar3r", "planar4r"] = "planar4r"

    def case(self, robot: Robot, change: Perturbation) -> Case:
        """See `Family`."""
        return replace(super().case(robot, change), q0=np.zeros(3) @ np.zeros((4, 4)))


MAKES_SCENARIOS = {
    f"check_family_{c}" for c in ("certificate", "parts", "seeds", "deterministic", "picklable")
}
DICE = {"check_family_deterministic", "check_family_picklable"}
LYING: list[tuple[Family, set[str]]] = [
    (NoRange(), {"check_family_ranges"}),
    (AcceptsAnything(), {"check_family_ranges"}),
    (BreaksAtAnEnd(), {"check_family_ranges"}),
    (ClaimsNothing(), {"check_family_certificate"}),
    (ClaimsTooMuch(), MAKES_SCENARIOS),
    (ChecksNothing(), {"check_family_certificate"}),
    (StartsNowhere(), {"check_family_parts"}),
    (VariesInSecret(), {"check_family_seeds"}),
    (StandsStill(), {"check_family_seeds"}),
    (TakesNegativeSeeds(), {"check_family_seeds"}),
    (ThrowsDice(), DICE),
    (HoldsLambda(), {"check_family_picklable"}),
    (DrawsNothing(), {"check_family_declaration"}),
    (Raises(), {*MAKES_SCENARIOS, "check_family_ranges"}),
]


def failing(family: Family) -> set[str]:
    """Names of the checks that a family fails."""
    names = set()
    for check in FAMILY_CHECKS:
        try:
            check(family)
        except AssertionError:
            names.add(check.__name__)
    return names


@pytest.mark.parametrize(
    ("family", "expected"), LYING, ids=[type(family).__name__ for family, _ in LYING]
)
def test_lying_family_fails_its_check_alone(family: Family, expected: set[str]) -> None:
    """A family with one defect fails the check for that defect, and no other."""
    assert failing(family) == expected


def test_honest_family_passes() -> None:
    """The family from which the lying ones are made keeps the contract."""
    check_family(Honest())


def test_what_is_no_family_is_named() -> None:
    """A class that is not derived from `Family` is none, whatever it can do."""
    pretender: Any = Variation()
    with pytest.raises(AssertionError, match=r"Variation is not an instance .*scenario\.Family"):
        check_family(pretender)


@pytest.mark.parametrize(
    ("family", "words"),
    [
        (NoRange(), "stretch is a number without a Range"),
        (AcceptsAnything(), r"depth=nan is accepted; valid: a number, 0 to 0.3 \[m\]"),
        (BreaksAtAnEnd(), "slowness=0.0: raised ZeroDivisionError"),
        (ClaimsNothing(), "seed 0: the certificate claims nothing"),
        (ClaimsTooMuch(), "seed 1: certificate of .* failed: seed = 1, must be >= 0 and <= 0"),
        (VariesInSecret(), "seed 1 changes the start; declare it in `variation`"),
        (StandsStill(), "seed 1 changes nothing, but declares start by up to"),
        (DrawsNothing(), "DrawsNothing.grid names 'speed'; valid: acceleration, angle"),
    ],
)
def test_failure_says_what_is_wrong(family: Family, words: str) -> None:
    """With the parameter or the seed."""
    with pytest.raises(AssertionError, match=words):
        check_family(family)
