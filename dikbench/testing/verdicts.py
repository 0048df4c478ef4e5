"""Every check of a plug-in with its outcome, instead of the first failure."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from functools import partial
from types import MappingProxyType
from typing import Any, Final, Literal, NamedTuple

from dikbench.problem.problem import Formulation, LimitKind, is_batched, is_strict, promises_of
from dikbench.robots.catalogue import CatalogueEntry
from dikbench.scenario.family import Family
from dikbench.scenario.plant import Plant
from dikbench.solvers.catalogue.back_ends import Solver
from dikbench.testing.asked import Asked
from dikbench.testing.cannot_check import CannotCheck
from dikbench.testing.contract import (
    CHECKS,
    Check,
    check_acceleration_limits,
    check_declaration,
    check_inequalities,
    check_position_limits,
    check_velocity_limits,
)
from dikbench.testing.family import FAMILY_CHECKS
from dikbench.testing.metric import METRIC_CHECKS, Metrics
from dikbench.testing.plant import PLANT_CHECKS
from dikbench.testing.priority import check_priority
from dikbench.testing.robot import ROBOT_CHECKS
from dikbench.testing.rows import check_rows
from dikbench.testing.solver import (
    SOLVER_CHECKS,
    check_solver_linear_programs,
    check_solver_presets,
    check_solver_warm,
    has_workspace,
    solves_linear,
)

PROMISES: Final[Mapping[Check, LimitKind]] = MappingProxyType(
    {
        check_position_limits: "position",
        check_velocity_limits: "velocity",
        check_acceleration_limits: "acceleration",
        check_inequalities: "inequalities",
    }
)
"""The checks of what a formulation need not promise, and what it would promise."""


class Verdict(NamedTuple):
    """What came of one check; `reason` says in one line what was violated.

    A check is `not checked` for a cause for which another is `BROKEN` already.
    """

    check: str
    outcome: Literal["kept", "not promised", "BROKEN", "not checked"]
    reason: str = ""


def verdicts_on_formulation(
    formulation: Formulation, solver: str | None = None
) -> Iterator[Verdict]:
    """Run the checks of a formulation one by one; a broken declaration ends them.

    Raises:
        DikbenchError: if the solver is unknown or cannot take what the formulation needs solved.
    """
    declaration = _verdict("declaration", partial(check_declaration, formulation, solver), {})
    yield declaration
    if declaration.outcome == "BROKEN":
        return
    asked, causes = Asked(formulation, solver), dict[str, str]()
    for check in CHECKS[1:]:
        name = check.__name__.removeprefix("check_").replace("_", " ")
        promised = PROMISES[check] in promises_of(formulation) if check in PROMISES else True
        promised &= check is not check_rows or is_batched(formulation)
        promised &= check is not check_priority or is_strict(formulation)
        if not promised:
            yield Verdict(name, "not promised")
        else:
            yield _verdict(name, partial(check, asked, None), causes)


def verdicts_on_family(family: Family) -> Iterator[Verdict]:
    """Run the checks of a scenario family one by one; a broken declaration ends them."""
    return _verdicts("family", FAMILY_CHECKS, family)


def verdicts_on_solver(solver: Solver) -> Iterator[Verdict]:
    """Run the checks of a solver likewise."""
    promised: dict[Callable[[Any], None], bool] = {
        check_solver_linear_programs: solves_linear(solver),
        check_solver_warm: has_workspace(solver),
        check_solver_presets: solver.library is not None and solver.library.has_presets(),
    }
    return _verdicts("solver", SOLVER_CHECKS, solver, promised)


def verdicts_on_plant(plant: Plant) -> Iterator[Verdict]:
    """Run the checks of a plant likewise."""
    return _verdicts("plant", PLANT_CHECKS, plant)


def verdicts_on_robot(entry: CatalogueEntry) -> Iterator[Verdict]:
    """Run the checks of a robot likewise."""
    return _verdicts("robot", ROBOT_CHECKS, entry)


def verdicts_on_metric(metrics: Metrics) -> Iterator[Verdict]:
    """Run the checks of a metric, or of a tuple of some, likewise."""
    return _verdicts("metric", METRIC_CHECKS, metrics)


def _verdicts(
    kind: str,
    checks: Sequence[Callable[[Any], None]],
    subject: object,
    promised: Mapping[Callable[[Any], None], bool] = MappingProxyType({}),
) -> Iterator[Verdict]:
    causes: dict[str, str] = {}
    for check in checks:
        name = check.__name__.removeprefix(f"check_{kind}_").replace("_", " ")
        if not promised.get(check, True):
            yield Verdict(name, "not promised")
            continue
        verdict = _verdict(name, partial(check, subject), causes)
        yield verdict
        if name == "declaration" and verdict.outcome == "BROKEN":
            return


def _verdict(name: str, check: Callable[[], None], causes: dict[str, str]) -> Verdict:
    """Make a check.

    Args:
        name: of the check.
        check: the check.
        causes: what kept earlier checks from being made, with the first of them; added to.
    """
    try:
        check()
    except CannotCheck as error:
        first = causes.setdefault(error.cause, name)
        if first != name:
            return Verdict(name, "not checked", f"for the same cause as {first}")
        return Verdict(name, "BROKEN", " ".join(str(error).split()))
    except AssertionError as error:
        return Verdict(name, "BROKEN", " ".join(str(error).split()))
    return Verdict(name, "kept")
