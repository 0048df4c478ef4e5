"""The versions that made rows, which are not those of the process that looks at them."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import Any, Final

from dikbench.selector import parse_selector

VALUES: Final = ("git_commit", "python", "system", "cpu", "governor", "cores", "blas")
"""Entries of a description that are one value each."""

SOURCES: Final = ("git_commit", "python")
"""Those of them that change what is computed."""

Made = tuple[str, str, Mapping[str, Any]]
"""The solver of some rows, the name of the environment that made them, and its description."""


def versions_of_rows(last: Mapping[str, Any], made: Iterable[Made]) -> dict[str, Any]:
    """Return the manifest of the last run with the versions that made the rows in place of its own.

    Where several made them, an entry names each. A solver's version is that with which its own
    rows were made; what made no row keeps the last run's.

    Args:
        last: the manifest of the last run, which may have made none of the rows.
        made: what made the rows that are shown.

    Returns:
        The manifest, with `environments` in addition: the description of each environment that a
        row refers to, by its name.
    """
    made = list(made)
    if not made:
        return dict(last)
    described = {name: description for _, name, description in made}
    found: dict[str, Any] = {**last, "environments": described}
    for key in VALUES:
        found[key] = _together([e[key] for e in described.values() if key in e], last.get(key))
    known = [e.get("libraries", {}) for e in described.values()]
    found["libraries"] = _each(known, last.get("libraries", {}))
    own = [
        {name: e.get("solvers", {}).get(name)}
        for solver, _, e in made
        if (name := parse_selector(solver).name) in e.get("solvers", {})
    ]
    found["solvers"] = _each(own, last.get("solvers", {}))
    return found


def is_outdated(solver: str, made: Mapping[str, Any] | None, now: Mapping[str, Any]) -> bool:
    """Say whether other sources or versions than those of now made a row.

    Args:
        solver: the selector of its solver, whose version counts; those of others do not.
        made: the description of what made it; None where nobody knows.
        now: the description of this process.
    """
    if made is None:
        return True
    name = parse_selector(solver).name
    return (
        any(made.get(key) != now.get(key) for key in (*SOURCES, "libraries"))
        or made.get("solvers", {}).get(name) != now.get("solvers", {}).get(name)
    )  # fmt: skip


def differences(
    one: Mapping[str, Any], other: Mapping[str, Any], solvers: Iterable[str]
) -> list[str]:
    """Say in which sources and versions two descriptions differ that change what is computed.

    Args:
        one: the description of a process.
        other: that of another one.
        solvers: names of the solvers that count.
    """
    pairs = {key: (one.get(key), other.get(key)) for key in SOURCES}
    a, b = one.get("libraries", {}), other.get("libraries", {})
    pairs |= {name: (a.get(name), b.get(name)) for name in {**a, **b}}
    a, b = one.get("solvers", {}), other.get("solvers", {})
    pairs |= {name: (a.get(name), b.get(name)) for name in solvers}
    return [f"{name} {a or 'none'} and {b or 'none'}" for name, (a, b) in pairs.items() if a != b]


def _each(found: Iterable[Mapping[str, Any]], last: Mapping[str, Any]) -> dict[str, Any]:
    """Return the versions of every name, those found before that of the last run."""
    versions: dict[str, list[Any]] = {name: [] for name in last}
    for one in found:
        for name, version in one.items():
            versions.setdefault(name, []).append(version)
    return {name: _together(given, last.get(name)) for name, given in versions.items()}


def _together(values: Iterable[Any], otherwise: Any) -> Any:
    """Return the one value; of several, a text that names each."""
    distinct = list(dict.fromkeys(values))
    if not distinct:
        return otherwise
    return distinct[0] if len(distinct) == 1 else ", ".join(sorted(map(str, distinct)))
