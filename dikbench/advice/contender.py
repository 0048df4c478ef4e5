"""A formulation with the solver that it is run with."""

from __future__ import annotations

from dataclasses import dataclass

from dikbench.plugins.building import in_declared_order
from dikbench.scenario.oracle import ORACLES
from dikbench.selector import Selector, parse_selector
from dikbench.solvers.catalogue.back_ends import DEFAULT_SOLVER, parse_solver
from dikbench.study.study import program_named
from dikbench.study.trial import NO_SOLVER


@dataclass(frozen=True)
class Contender:
    """A formulation with the solver that it is run with.

    Attributes:
        formulation: its selector.
        solver: `NO_SOLVER` where it needs none.
    """

    formulation: Selector
    solver: Selector

    def __str__(self) -> str:
        """Name both."""
        solver = "" if self.solver == NO_SOLVER else f" with {self.solver}"
        return f"{self.formulation}{solver}"


def contender(formulation: str | Selector, solver: str = "") -> Contender:
    """Give a formulation its solver: the default one where none is named and it needs one.

    Raises:
        DikbenchError: if there is no such formulation or solver, or it is an oracle.
    """
    selector = in_declared_order("formulation", formulation)
    program = program_named(selector)
    if solver:
        parse_solver(solver)
    if program is None or selector.name in ORACLES:
        return Contender(selector, NO_SOLVER)
    return Contender(selector, parse_selector(solver or DEFAULT_SOLVER[program]))
