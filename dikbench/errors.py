"""Errors, one line each: what was wrong, where, and what would have been valid."""

from __future__ import annotations

import difflib
import sysconfig
import traceback
from collections.abc import Iterable
from pathlib import Path
from typing import Final

LONGEST_CHARACTERS: Final = 300
"""An error that lists more than this lists the nearest names alone."""

NEAREST_NAMES: Final = 5


class DikbenchError(Exception):
    """The root of every error that a user of dikbench can cause."""


class CannotAnswer(DikbenchError):
    """A formulation or a solver has no velocity for this control step.

    Raised by a formulation or by its `solve`; the harness then applies the fallback and records the
    status. A formulation raises nothing else in normal operation.
    """


class Infeasible(CannotAnswer):
    """The program of this control step has no feasible point."""


class SolverFailed(CannotAnswer):
    """The solver has no answer to a program that has a feasible point."""


def unknown(
    what: str, name: object, valid: Iterable[object], where: str = "", every: str = ""
) -> DikbenchError:
    """Build the error for a name that is not among the valid ones, nearest match first.

    Where the valid names are too many for a line, it lists those that are nearest.

    Args:
        what: the kind of thing that was named, in the singular ("formulation").
        name: the name as given.
        valid: the names that would have been accepted.
        where: the place of the name ("in studies/mine.toml"), if there is more than one.
        every: the command that lists all of them, if there is one.

    Returns:
        The error, to be raised by the caller.
    """
    names = sorted(str(candidate) for candidate in valid)
    nearest = difflib.get_close_matches(str(name), names, n=1)
    hint = f"; did you mean {nearest[0]!r}?" if nearest else ";"
    place = f" {where}" if where else ""
    said = f"unknown {what} {str(name)!r}{place}{hint} valid: "
    listed = ", ".join(names) if names else "none"
    if len(said) + len(listed) > LONGEST_CHARACTERS:
        near = difflib.get_close_matches(str(name), names, n=NEAREST_NAMES, cutoff=0.0)
        every = f", listed by `{every}`" if every else ""
        listed = f"{', '.join(near)}, ... ({len(names)} in all{every})"
    return DikbenchError(said + listed)


def in_words(error: BaseException) -> str:
    """Write an error of a plug-in in one line: type, message, file and line of the author's code.

    The line is the innermost one outside of dikbench and installed packages, if there is one.
    """
    said = f"{type(error).__name__}: {str(error).strip()}".partition("\n")[0].rstrip(": ")
    own = [f for f in traceback.extract_tb(error.__traceback__) if _is_an_authors(f.filename)]
    return f"{said} ({Path(own[-1].filename).name}, line {own[-1].lineno})" if own else said


def _is_an_authors(file: str) -> bool:
    installed = (sysconfig.get_path("stdlib"), str(Path(__file__).parent))
    inside = file.startswith(installed) or "site-packages" in file or "dist-packages" in file
    return not inside and file.endswith(".py")
