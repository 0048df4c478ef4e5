"""The formulations and the families of a run, as a page describes them."""

from __future__ import annotations

import ast
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Final

import pandas as pd

from dikbench.plugins.built_scenarios import built
from dikbench.plugins.finding import formulations_and_peers, in_file, plugins
from dikbench.report.contents.bibliography import references
from dikbench.report.contents.docstring import Docstring, parse_docstring
from dikbench.results.columns import SELECTORS
from dikbench.results.selected import parameters_of
from dikbench.scenario.oracle import ORACLES, SLOWED_ORACLE

MOST_CERTIFICATES: Final = 40
"""Scenarios of a family whose certificates are shown."""


@dataclass(frozen=True)
class Variant:
    """A formulation as it was run.

    Attributes:
        selector: as the user wrote it.
        solvers: with which it ran.
        attributes: every attribute and its value, in words.
    """

    selector: str
    solvers: tuple[str, ...]
    attributes: Mapping[str, str]


@dataclass(frozen=True)
class FormulationOfRun:
    """A formulation of a run.

    Attributes:
        name: of the formulation, or path/to/file.py:Class.
        text: its docstring; None where it cannot be found here.
        variants: as it was run.
        references: what the keys of its source stand for.
    """

    name: str
    text: Docstring | None
    variants: tuple[Variant, ...]
    references: tuple[str, ...]


@dataclass(frozen=True)
class Certified:
    """A scenario of a run.

    Attributes:
        selector: of the scenario.
        claims: its certificate, claim by claim.
        problem: why it cannot be built here; empty where it can.
    """

    selector: str
    claims: tuple[str, ...]
    problem: str = ""


@dataclass(frozen=True)
class Family:
    """A scenario family of a run.

    Attributes:
        name: of the family.
        text: its docstring; None where it is not registered here.
        scenarios: its scenarios in the run, with the certificates of their first seed.
        left_out: how many more there are.
        variation: what a seed perturbs, in words.
    """

    name: str
    text: Docstring | None
    scenarios: tuple[Certified, ...]
    left_out: int
    variation: str


def formulations_of(trials: pd.DataFrame) -> list[FormulationOfRun]:
    """The formulations of a run in its order, the oracle last."""
    solvers: dict[str, list[str]] = {}
    for selector, solver in zip(trials["formulation"], trials["solver"], strict=True):
        with_ = solvers.setdefault(selector, [])
        if solver not in ("none", *with_):
            with_.append(solver)
    parameters = parameters_of(trials, "formulation")
    found = []
    for name, selectors in sorted(
        _by_name(trials, "formulation").items(), key=lambda item: item[0] in ORACLES
    ):
        text, defaults, file = _described(name)
        variants = tuple(
            Variant(
                selector,
                tuple(solvers[selector]),
                {**defaults, **{key: str(value) for key, value in parameters[selector].items()}},
            )
            for selector in selectors
        )
        parsed = None if text is None else parse_docstring(text)
        cited = references(file, parsed.titled.get("Source", "")) if parsed else ()
        found.append(FormulationOfRun(name, parsed, variants, cited))
    return found


def _by_name(trials: pd.DataFrame, column: str) -> dict[str, list[str]]:
    """Group the selectors of a column by the name of what they select, in their order."""
    named = trials.drop_duplicates(column).groupby(f"{column}_{SELECTORS[column]}", sort=False)
    return {str(name): list(selectors) for name, selectors in named[column]}


def _described(name: str) -> tuple[str | None, dict[str, str], Path | None]:
    """Docstring, default values and file of a formulation.

    A formulation that is given as a file is read and not executed: results are data, and remaking
    their report must not run what they name.
    """
    if name in ORACLES:
        slowed = ", slowed down until it keeps all limits" if name == SLOWED_ORACLE else ""
        what = "The joint motion from which a scenario's path was built"
        return f"{what}{slowed}, scored like a formulation.", {}, None
    if in_file(name):
        return *_read(name), None
    plugin = formulations_and_peers().get(name)
    if plugin is None:
        return None, {}, None
    defaults = {
        key: str(parameter.default)
        for key, parameter in plugin.parameters.items()
        if not parameter.required
    }
    return plugin.factory.__doc__ or "", defaults, Path(plugin.file)


def _read(name: str) -> tuple[str | None, dict[str, str]]:
    """Read docstring and defaults of a class that is given as `path/to/file.py:Class`."""
    path, _, class_name = name.rpartition(":")
    try:
        tree = ast.parse(Path(path).read_text(encoding="utf-8"))
    except (OSError, ValueError, SyntaxError):
        return None, {}
    for node in ast.walk(tree):
        if isinstance(node, ast.ClassDef) and node.name == class_name:
            fields = {
                line.target.id: ast.unparse(line.value)
                for line in node.body
                if isinstance(line, ast.AnnAssign)
                and isinstance(line.target, ast.Name)
                and line.value is not None
                and "ClassVar" not in ast.unparse(line.annotation)
            }
            return ast.get_docstring(node) or "", fields
    return None, {}


def families_of(trials: pd.DataFrame) -> list[Family]:
    """The families of a run in its order, with the certificates of their scenarios."""
    seeds = trials.groupby("scenario")["seed"].min()
    known = plugins("scenario")
    found = []
    for name, selectors in _by_name(trials, "scenario").items():
        plugin = known.get(name)
        text = plugin.factory.__doc__ or "" if plugin else _read(name)[0] if in_file(name) else None
        certified, variation = _certified(selectors[:MOST_CERTIFICATES], seeds)
        found.append(
            Family(
                name,
                None if text is None else parse_docstring(text),
                certified,
                len(selectors) - len(certified),
                variation,
            )
        )
    return found


def _certified(selectors: Iterable[str], seeds: pd.Series) -> tuple[tuple[Certified, ...], str]:
    """Scenarios with their certificates, and what a seed perturbs of the last one."""
    found, variation = [], ""
    for selector in selectors:
        scenario = built(selector, int(seeds[selector]))
        if isinstance(scenario, str):
            found.append(Certified(selector, (), scenario))
        else:
            claims = tuple(str(claim) for claim in scenario.certificate.claims)
            found.append(Certified(selector, claims))
            variation = str(scenario.variation)
    return tuple(found), variation
