"""The interfaces of a solver of another author; its answers are looked at before they are used."""

from __future__ import annotations

import numpy as np

from dikbench.programs.answer import Answer
from dikbench.programs.quadratic_program import QuadraticProgram
from dikbench.solvers.catalogue.library import SolverLibrary


class LibrarySolver:
    """A solver of another author, called from scratch for every program."""

    __slots__ = ("_library",)

    def __init__(self, library: SolverLibrary) -> None:
        self._library = library

    def __call__(self, program: QuadraticProgram, site: int = 0) -> Answer:
        """Solve a program; any failure gives an answer that is not claimed."""
        try:
            return _checked(self._library.solve(program), len(program.q))
        except Exception:  # each library raises its own
            return Answer(None, claimed=False)


class LibraryWorkspace:
    """The workspace of a solver of another author."""

    __slots__ = ("_workspace",)

    def __init__(self, library: SolverLibrary, program: QuadraticProgram) -> None:
        self._workspace = library.workspace(program)

    def solve(self, program: QuadraticProgram) -> Answer:
        """See `Workspace`."""
        return _checked(self._workspace.solve(program), len(program.q))


def _checked(answer: Answer, n: int) -> Answer:
    """Return an answer whose x is n floats; none in place of any other.

    Raises:
        AttributeError: if it is no answer at all.
    """
    x = answer.x
    fits = isinstance(x, np.ndarray) and x.shape == (n,) and x.dtype == float
    return answer if fits else Answer(None, claimed=False, core_ns=answer.core_ns)
