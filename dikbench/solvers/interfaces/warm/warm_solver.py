"""A back end that keeps its workspaces during a trial."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from importlib import import_module
from typing import Any, Final

from dikbench.programs.answer import Answer
from dikbench.programs.quadratic_program import QuadraticProgram
from dikbench.solvers.catalogue.back_ends import Solver
from dikbench.solvers.catalogue.library import Workspace
from dikbench.solvers.interfaces.of_library import LibraryWorkspace

WORKSPACES: Final = {
    "osqp": "OsqpWorkspace",
    "clarabel": "ClarabelWorkspace",
    "piqp": "PiqpWorkspace",
    "proxqp": "ProxqpWorkspace",
    "daqp": "DaqpWorkspace",
    "highs": "HighsWorkspace",
}
"""The class of each back end, in the file named after it."""


Structure = tuple[int, int | None, int | None, bool, bool]
"""Number of unknowns, of equalities and inequalities, and which bounds are missing."""


class WarmSolver:
    """A back end with a workspace per call site, remade where the structure changes."""

    __slots__ = ("_make", "_sites")

    def __init__(self, solver: Solver) -> None:
        self._make = _maker(solver)
        self._sites: dict[int, tuple[Structure, Workspace]] = {}

    def __call__(self, program: QuadraticProgram, site: int) -> Answer:
        """Solve a program; any failure gives an answer that is not claimed.

        Args:
            program: what to solve.
            site: number of the call within its control step; a site sees similar programs.
        """
        b, h = program.b, program.h
        structure = (
            len(program.q),
            None if b is None else len(b),
            None if h is None else len(h),
            program.lb is None,
            program.ub is None,
        )
        known, workspace = self._sites.pop(site, (None, None))
        if workspace is not None and known == structure:
            answer = _solved(workspace, program)
            if answer.claimed:
                self._sites[site] = structure, workspace
                return answer
        try:  # from scratch, without what failed
            workspace = self._make(program)
        except Exception:
            return Answer(None, claimed=False)
        answer = _solved(workspace, program)
        if answer.claimed:
            self._sites[site] = structure, workspace
        return answer


def _maker(solver: Solver) -> Callable[[QuadraticProgram], Workspace]:
    """Return what allocates the workspace of a program."""
    if solver.library is not None:
        return partial(LibraryWorkspace, solver.library)
    module = import_module(f"dikbench.solvers.interfaces.warm.{solver.name}_workspace")
    kind: Any = getattr(module, WORKSPACES[solver.name])
    return partial(kind, settings=solver.settings)


def _solved(workspace: Workspace, program: QuadraticProgram) -> Answer:
    try:
        return workspace.solve(program)
    except Exception:  # each library raises its own
        return Answer(None, claimed=False)
