"""Errors, one line each: what was wrong, where, and what would have been valid."""

from __future__ import annotations

import difflib
from collections.abc import Iterable


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


def unknown(what: str, name: object, valid: Iterable[object], where: str = "") -> DikbenchError:
    """Build the error for a name that is not among the valid ones, nearest match first.

    Args:
        what: the kind of thing that was named, in the singular ("formulation").
        name: the name as given.
        valid: the names that would have been accepted.
        where: the place of the name ("in studies/mine.toml"), if there is more than one.

    Returns:
        The error, to be raised by the caller.
    """
    names = sorted(str(candidate) for candidate in valid)
    nearest = difflib.get_close_matches(str(name), names, n=1)
    hint = f"; did you mean {nearest[0]!r}?" if nearest else ";"
    place = f" {where}" if where else ""
    listed = ", ".join(names) if names else "none"
    return DikbenchError(f"unknown {what} {str(name)!r}{place}{hint} valid: {listed}")
