"""The contract that every scenario family keeps, as checks for the author of a family.

    @pytest.mark.parametrize("check", dikbench.testing.FAMILY_CHECKS)
    def test_contract(check):
        check(MyFamily())

or, without pytest, `check_family(MyFamily())`. A check that fails raises `AssertionError` with the
parameter or the seed, and what was violated.
"""

from __future__ import annotations

import pickle
from collections.abc import Callable
from dataclasses import is_dataclass
from itertools import chain
from typing import Final

import numpy as np

from dikbench.arrays import Array
from dikbench.errors import DikbenchError, in_words
from dikbench.parameters import parameters_of
from dikbench.scenario.certificate import CertificateFailed
from dikbench.scenario.family import Family
from dikbench.scenario.misfits import misfits
from dikbench.scenario.scenario import Scenario
from dikbench.testing.cannot_check import CannotCheck
from dikbench.testing.first_step import no_first_step
from dikbench.testing.parameters import assert_ranges, changed_to, ends_of

SEEDS: Final = (0, 1, 2)
"""The seeds of the scenarios that are checked; 0 perturbs nothing."""

FamilyCheck = Callable[[Family], None]


def check_family_declaration(family: Family) -> None:
    """Check that the family is a frozen dataclass, derived from `Family`, and says what it is."""
    name = type(family).__name__
    frozen = getattr(getattr(family, "__dataclass_params__", None), "frozen", False)
    if not isinstance(family, Family) or not is_dataclass(family) or not frozen:
        raise AssertionError(
            f"{name} is not an instance of a class with @dataclass(frozen=True) that is derived "
            "from dikbench.scenario.Family"
        )
    known = parameters_of(type(family))
    for parameter in family.grid or ():
        if parameter not in known:
            raise AssertionError(
                f"{name}.grid names {parameter!r}; valid: {', '.join(sorted(known))}"
            )


def check_family_ranges(family: Family) -> None:
    """Check that every number has a `Range`, and that its ends give a scenario or say why not.

    What is outside of a range, and NaN, must be refused by an error that names the parameter.
    """
    assert_ranges(family)
    for name, value in ends_of(family):
        try:
            changed_to(family, name, value).scenario(0)
        except DikbenchError:
            pass  # it says why there is no such scenario
        except Exception as error:
            said = in_words(error)
            raise CannotCheck(f"{name}={value}: raised {said}", said) from error


def check_family_certificate(family: Family) -> None:
    """Check that the certificate claims something and holds."""
    for seed in SEEDS:
        made = _scenario(family, seed)
        where = f"seed {seed}"
        if not made.certificate.claims:
            raise AssertionError(f"{where}: the certificate claims nothing")
        try:
            made.certificate.check(type(family).__name__)
        except CertificateFailed as error:
            raise AssertionError(f"{where}: {error}") from error


def check_family_parts(family: Family) -> None:
    """Check that the parts of its scenarios fit together.

    Start and exact motion fit the robot and each other; gains and priorities are valid; along the
    exact motion the tracking error is zero (at its end, where the target rests); a planar arm is
    asked for nothing out of its plane; the first control step can be posed and solved.
    """
    for seed in SEEDS:
        made = _scenario(family, seed)
        try:
            wrong = next(chain(misfits(made), no_first_step(made)), "")
        except MemoryError:
            raise
        except Exception as error:
            raise AssertionError(f"seed {seed}: raised {in_words(error)}") from error
        if wrong:
            raise AssertionError(f"seed {seed}: {wrong}")


def check_family_seeds(family: Family) -> None:
    """Check that seeds perturb the scenario where a variation is declared, and only there.

    A negative seed must be refused.
    """
    try:
        family.scenario(-1)
    except DikbenchError:
        pass
    else:
        raise AssertionError("seed -1 is accepted; seeds must not be negative")
    plain, declared = _scenario(family, 0), str(family.variation)
    for seed in SEEDS[1:]:
        changed = _difference(plain, _scenario(family, seed))
        if changed and declared == "nothing":
            raise AssertionError(f"seed {seed} changes {changed}; declare it in `variation`")
        if not changed and declared != "nothing":
            raise AssertionError(f"seed {seed} changes nothing, but declares {declared}")


def check_family_deterministic(family: Family) -> None:
    """Check that the same parameters and seed give the same scenario, to the bit."""
    for seed in SEEDS:
        changed = _difference(_scenario(family, seed), _scenario(family, seed))
        if changed:
            raise AssertionError(f"seed {seed}: made again, {changed} is another")


def check_family_picklable(family: Family) -> None:
    """Check that the family can be pickled, and that the copy gives the same scenario."""
    try:
        unpickled = pickle.loads(pickle.dumps(family))
    except Exception as error:
        raise AssertionError(
            f"{type(family).__name__} cannot be pickled ({error}); workers are processes: "
            "define the class at the top of a module, with parameters that pickle"
        ) from error
    changed = _difference(_scenario(family, 1), _scenario(unpickled, 1))
    if changed:
        raise AssertionError(f"unpickled, {changed} is another")


def _scenario(family: Family, seed: int) -> Scenario:
    """Make the scenario of a seed; whatever goes wrong is a broken contract."""
    try:
        return family.scenario(seed)
    except MemoryError:
        raise
    except DikbenchError as error:
        raise CannotCheck(f"seed {seed}: {error}", str(error)) from error
    except Exception as error:
        said = in_words(error)
        raise CannotCheck(f"seed {seed}: raised {said}", said) from error


def _difference(a: Scenario, b: Scenario) -> str:
    """Name the first part in which two scenarios differ; empty where they do not."""
    first, second = _numbers(a), _numbers(b)
    for name, value in first.items():
        if not np.array_equal(value, second[name], equal_nan=True):
            return name
    return ""


def _numbers(scenario: Scenario) -> dict[str, Array]:
    """List what a run sees of a scenario, by name, as arrays."""
    reference = scenario.reference
    at = [reference.duration * share for share in np.linspace(0.0, 1.0, 7)]
    return {
        "the start": scenario.q0,
        "the start velocity": scenario.v0,
        "the duration": np.array([scenario.dt, scenario.duration, reference.duration]),
        "the path": np.array([reference.placement(tau).homogeneous for tau in at]),
        "the velocity of the reference": np.array([reference.velocity(tau) for tau in at]),
        "the certificate": np.array([claim.value for claim in scenario.certificate.claims]),
    }


FAMILY_CHECKS: Final[tuple[FamilyCheck, ...]] = (
    check_family_declaration,
    check_family_ranges,
    check_family_certificate,
    check_family_parts,
    check_family_seeds,
    check_family_deterministic,
    check_family_picklable,
)
"""Every check of a family: (family) -> None."""


def check_family(family: Family) -> None:
    """Run every check; the first one that fails raises `AssertionError`."""
    for check in FAMILY_CHECKS:
        check(family)
