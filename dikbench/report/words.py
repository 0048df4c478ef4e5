"""Numbers and names in sentences."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
from typing import Final

Law = tuple[str, str]
"""A formulation and its solver."""

FEW: Final = 6
"""More names than this are counted, not listed."""


def number(value: float) -> str:
    """Three significant digits, no exponent where it can be read without; rounding is 0."""
    if not math.isfinite(value):
        return str(value)
    if abs(value) < 1e-9:
        return "0"
    return f"{value:.3g}" if 1e-4 <= abs(value) < 999.5 else _far(value)


def _far(value: float) -> str:
    return f"{value:.2e}" if abs(value) < 1e-4 or abs(value) >= 1e6 else f"{value:.0f}"


def millimetres(metres: float) -> str:
    """A length."""
    return f"{number(1e3 * metres)} mm"


def degrees(radians: float) -> str:
    """An angle."""
    return f"{number(math.degrees(radians))} deg"


def several(count: int, what: str) -> str:
    """A count and its noun."""
    return f"{count} {what}" if count == 1 else f"{count} {what}s"


def listed(names: Sequence[str], most: int | None = FEW) -> str:
    """Names in a sentence: `a`, `b` and 5 more."""
    shown = list(names if most is None or len(names) <= most + 1 else names[:most])
    if len(shown) < len(names):
        return f"{', '.join(shown)} and {len(names) - len(shown)} more"
    return " and ".join([", ".join(shown[:-1]), shown[-1]]) if len(shown) > 1 else "".join(shown)


def laws_named(laws: Iterable[Law], solvers: Mapping[str, Sequence[str]]) -> list[str]:
    """Laws with their solvers: `qp` (daqp, osqp); "all 8 solvers" where it is all that it ran with.

    Args:
        laws: those that are meant.
        solvers: the solvers with which each formulation ran.
    """
    groups: dict[str, list[str]] = {}
    for formulation, solver in laws:
        groups.setdefault(formulation, []).append(solver)
    names = []
    for formulation, with_ in groups.items():
        every = len(with_) == len(solvers[formulation])
        if every and len(with_) > 2:
            names.append(f"`{formulation}` (all {len(with_)} solvers)")
        elif with_ == ["none"] or (every and len(with_) == 1):
            names.append(f"`{formulation}`")
        else:
            names.append(f"`{formulation}` ({', '.join(with_)})")
    return names
