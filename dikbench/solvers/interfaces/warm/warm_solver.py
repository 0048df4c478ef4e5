"""A back end that keeps its workspaces through a trial."""

from __future__ import annotations

from importlib import import_module
from typing import Final

from dikbench.programs.answer import Answer
from dikbench.programs.quadratic_program import QuadraticProgram
from dikbench.solvers.catalogue.back_ends import Solver
from dikbench.solvers.interfaces.warm.workspace import Workspace

WORKSPACES: Final = {
    "osqp": "OsqpWorkspace",
    "clarabel": "ClarabelWorkspace",
    "piqp": "PiqpWorkspace",
    "proxqp": "ProxqpWorkspace",
    "daqp": "DaqpWorkspace",
    "highs": "HighsWorkspace",
}
"""The class of each back end, in the file of the back end's name."""


Structure = tuple[int, int | None, int | None, bool, bool]
"""Number of unknowns, of equalities and inequalities, and which bounds there are not."""

NOTHING: Final = None, None
FAILED: Final = Answer(None, claimed=False)


class WarmSolver:
    """A back end with a workspace per call site, made anew where the structure changes."""

    __slots__ = ("_make", "_settings", "_sites")

    def __init__(self, solver: Solver) -> None:
        module = import_module(f"dikbench.solvers.interfaces.warm.{solver.name}_workspace")
        self._make: type[Workspace] = getattr(module, WORKSPACES[solver.name])
        self._settings = solver.settings
        self._sites: dict[int, tuple[Structure, Workspace]] = {}

    def __call__(self, program: QuadraticProgram, site: int) -> Answer:
        """Solve a program; a failure of any kind is an answer that claims nothing.

        Args:
            program: what to solve.
            site: number of the call within its control step: the same site meets similar programs.
        """
        b, h = program.b, program.h
        structure = (
            len(program.q),
            None if b is None else len(b),
            None if h is None else len(h),
            program.lb is None,
            program.ub is None,
        )
        known, workspace = self._sites.get(site, NOTHING)
        answer = FAILED
        if workspace is not None and known == structure:
            answer = _solved(workspace, program)
        if not answer.claimed:  # what failed is no place to start from: once more, from scratch
            self._sites.pop(site, None)
            try:
                workspace = self._make(program, self._settings)
            except Exception:
                return FAILED
            answer = _solved(workspace, program)
            if answer.claimed:
                self._sites[site] = structure, workspace
        return answer


def _solved(workspace: Workspace, program: QuadraticProgram) -> Answer:
    try:
        return workspace.solve(program)
    except Exception:  # each library has its own
        return FAILED
