"""The interface of every warm back end."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, Protocol

from dikbench.programs.answer import Answer
from dikbench.programs.quadratic_program import QuadraticProgram


class Workspace(Protocol):
    """Memory and factors of one solver for programs of one structure."""

    def __init__(self, program: QuadraticProgram, settings: Mapping[str, Any]) -> None:
        """Allocate memory for programs of this one's structure."""
        ...

    def solve(self, program: QuadraticProgram) -> Answer:
        """Solve a program of this structure, starting from the previous answer.

        The arrays of the answer belong to the caller. Its core time is that of the library's
        solving call, without the copying of values.
        """
        ...
