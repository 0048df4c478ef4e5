"""Solvers: everything that the author of a solver imports.

A solver is a frozen dataclass that is derived from `SolverLibrary`: its fields are its settings.
"""

from __future__ import annotations

from dikbench.arrays import Array
from dikbench.parameters import Range
from dikbench.programs.answer import Answer
from dikbench.programs.quadratic_program import ProgramKind, QuadraticProgram
from dikbench.programs.two_sided import multipliers_of, two_sided
from dikbench.solvers.catalogue.library import SolverLibrary, Workspace

__all__ = [
    "Answer",
    "Array",
    "ProgramKind",
    "QuadraticProgram",
    "Range",
    "SolverLibrary",
    "Workspace",
    "multipliers_of",
    "two_sided",
]
