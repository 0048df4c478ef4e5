"""A back end that keeps its workspaces through a trial."""

from __future__ import annotations

from importlib import import_module
from typing import Final

from dikbench.quadratic_program import QuadraticProgram
from dikbench.solvers.answer import Answer
from dikbench.solvers.catalogue import Solver
from dikbench.solvers.warm.workspace import Workspace

WORKSPACES: Final = {
    "osqp": "OsqpWorkspace",
    "clarabel": "ClarabelWorkspace",
    "piqp": "PiqpWorkspace",
    "proxqp": "ProxqpWorkspace",
    "daqp": "DaqpWorkspace",
    "highs": "HighsWorkspace",
}
"""The class of each back end, in the file of the back end's name."""


class WarmSolver:
    """A back end with a workspace per call site of a control step and structure of the program."""

    __slots__ = ("_make", "_settings", "_workspaces")

    def __init__(self, solver: Solver) -> None:
        module = import_module(f"dikbench.solvers.warm.{solver.name}_workspace")
        self._make: type[Workspace] = getattr(module, WORKSPACES[solver.name])
        self._settings = solver.settings
        self._workspaces: dict[tuple[object, ...], Workspace] = {}

    def __call__(self, program: QuadraticProgram, site: int) -> Answer:
        """Solve a program; a failure of any kind is an answer that claims nothing.

        Args:
            program: what to solve.
            site: number of the call within its control step: the same site meets similar programs.
        """
        key = (
            site,
            len(program.q),
            -1 if program.b is None else len(program.b),
            -1 if program.h is None else len(program.h),
            program.lb is None,
            program.ub is None,
        )
        try:
            workspace = self._workspaces.get(key)
            if workspace is None:
                workspace = self._workspaces[key] = self._make(program, self._settings)
            answer = workspace.solve(program)
        except Exception:  # each library has its own
            answer = Answer(None, claimed=False)
        if not answer.claimed:  # what failed is no place to start from
            self._workspaces.pop(key, None)
        return answer
