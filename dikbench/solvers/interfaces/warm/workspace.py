"""What every warm back end offers."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, Protocol

from dikbench.programs.answer import Answer
from dikbench.programs.quadratic_program import QuadraticProgram


class Workspace(Protocol):
    """Memory and factors of one solver for programs of one structure."""

    def __init__(self, program: QuadraticProgram, settings: Mapping[str, Any]) -> None:
        """Make room for programs of this one's structure."""
        ...

    def solve(self, program: QuadraticProgram) -> Answer:
        """Put this program's values in, start from the answer before, and solve.

        The arrays of the answer are the caller's own. Its core time is that of the library's call
        that solves; taking the values over is the interface's.
        """
        ...
