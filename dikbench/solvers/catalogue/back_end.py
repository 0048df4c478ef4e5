"""What is known of a solver library: what it can solve, how it is called, its settings."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any, Literal

from dikbench.programs.quadratic_program import ProgramKind
from dikbench.solvers.catalogue.library import SolverLibrary
from dikbench.user_code import Named

Interface = Literal["cold", "warm", "cvxpy"]


@dataclass(frozen=True)
class BackEnd:
    """A solver library.

    Attributes:
        summary: one line for `dikbench list solvers`.
        package: the name of the library, for importing and installing it.
        programs: what it can solve when called with matrices.
        interfaces: how it can be called, the default first.
        settings: the settings that it takes, with their types.
        no_lp: why it cannot solve linear programs; empty where it can.
        own_defaults: settings with a default of dikbench instead of the library's.
        library: the class of one that does not come with dikbench; None for those that do.
        found: where that class was found.
    """

    summary: str
    package: str
    programs: frozenset[ProgramKind]
    interfaces: tuple[Interface, ...]
    settings: Mapping[str, type]
    no_lp: str = ""
    own_defaults: Mapping[str, Any] = field(default_factory=dict)
    library: type[SolverLibrary] | None = None
    found: Named | None = None
