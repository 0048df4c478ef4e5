"""The interface of a solver that does not come with dikbench."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, ClassVar, Protocol

from dikbench.parameters import Parameters
from dikbench.programs.answer import Answer
from dikbench.programs.quadratic_program import ProgramKind, QuadraticProgram


class Workspace(Protocol):
    """Memory and factors of one solver for programs of one structure."""

    def solve(self, program: QuadraticProgram) -> Answer:
        """Solve a program of this structure, starting from the previous answer.

        The arrays of the answer belong to the caller. Its core time is that of the library's
        solving call, without the copying of values.
        """
        ...


@dataclass(frozen=True)
class SolverLibrary(Parameters, ABC):
    """A solver of another author; its fields are its settings, with their ranges.

    Its answers are timed and rechecked like those of every other solver. A paragraph `Source: ...`
    of its docstring names the paper.

    Attributes:
        programs: what it solves: "qp", with a positive semidefinite P, and "lp", where P is 0.
        package: the distribution whose version is part of what identifies a trial.
    """

    programs: ClassVar[frozenset[ProgramKind]] = frozenset({"qp"})
    package: ClassVar[str] = ""

    @abstractmethod
    def solve(self, program: QuadraticProgram) -> Answer:
        """Solve a program from scratch; an answer that is not `claimed` is none.

        Whatever it raises is no answer. With the multipliers in the answer its dual residual and
        its gap are known as well (see `multipliers_of`).
        """

    def workspace(self, program: QuadraticProgram) -> Workspace:
        """Allocate memory for programs of this one's structure, for `[interface=warm]`.

        A solver that does not define it has no warm interface.
        """
        raise NotImplementedError

    @classmethod
    def preset(cls, tolerance: float) -> Mapping[str, Any]:
        """Return the settings that ask for residuals of at most a tolerance.

        A solver that does not define it has no preset but `default`.
        """
        raise NotImplementedError

    @classmethod
    def has_workspace(cls) -> bool:
        """Say whether it has a warm interface."""
        return cls.workspace is not SolverLibrary.workspace

    @classmethod
    def has_presets(cls) -> bool:
        """Say whether it has presets."""
        return cls.preset.__func__ is not SolverLibrary.preset.__func__  # type: ignore[attr-defined]
