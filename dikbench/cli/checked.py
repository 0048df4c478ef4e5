"""What a command line names to be checked: a plug-in, all of a file, all of a project."""

from __future__ import annotations

import tomllib
from collections.abc import Iterator
from importlib.metadata import EntryPoint
from pathlib import Path
from types import ModuleType
from typing import Any, Final

from dikbench.cli.kinds import IN_WORDS, kind_named, kind_of_value
from dikbench.errors import DikbenchError, unknown
from dikbench.metrics import EVERY_METRIC
from dikbench.plugins.building import make_family, make_formulation, make_plant
from dikbench.plugins.finding import formulations_and_peers, plugins
from dikbench.problem.problem import not_installed
from dikbench.robots.plugged import robot_entry
from dikbench.selector import Selector, parse_selector
from dikbench.solvers.catalogue.back_ends import parse_solver
from dikbench.testing.verdicts import (
    Verdict,
    verdicts_on_family,
    verdicts_on_formulation,
    verdicts_on_metric,
    verdicts_on_plant,
    verdicts_on_robot,
    verdicts_on_solver,
)
from dikbench.user_code import (
    TABLES,
    Kind,
    entries_of,
    entry_points_added,
    module_from_file,
    own_names,
)

Subject = tuple[str, Iterator[Verdict]]
"""What is checked (empty where there is one thing alone), and what comes of it."""

PROJECT: Final = "pyproject.toml"


def subjects(text: str, solver: str | None) -> Iterator[Subject]:
    """Yield what a text names.

    Args:
        text: a selector, a file, or the folder of a project.
        solver: the solver with which formulations are checked.

    Raises:
        DikbenchError: if it names nothing that can be checked.
    """
    if Path(text).is_dir():
        yield from _of_project(Path(text), solver)
        return
    if text.endswith(".py"):
        yield from _of_module(module_from_file(text), text, solver)
        return
    selector = parse_selector(text)
    kind = kind_named(selector.name)
    if kind is None:
        where = "(or give path/to/file.py:Name)"
        known = [*formulations_and_peers(), *plugins("scenario")]
        raise unknown("plug-in", selector.name, known, where, "dikbench list")
    if solver is not None and kind != "formulation":
        raise DikbenchError(f"--solver {solver}: {text} is {IN_WORDS[kind]}, which needs none")
    yield "", _verdicts(kind, selector, solver)


def _verdicts(kind: Kind, selector: Selector, solver: str | None) -> Iterator[Verdict]:
    if kind == "formulation":
        formulation = make_formulation(selector)
        if missing := not_installed(formulation):
            raise DikbenchError(f"formulation {selector}: {missing}")
        return verdicts_on_formulation(formulation, solver)
    if kind == "scenario":
        return verdicts_on_family(make_family(selector))
    if kind == "solver":
        return verdicts_on_solver(parse_solver(selector))
    if kind == "plant":
        return verdicts_on_plant(make_plant(selector))
    if selector.parameters:
        raise DikbenchError(f"{selector}: {kind}s have no parameters here; valid: {selector.name}")
    if kind == "robot":
        return verdicts_on_robot(robot_entry(selector.name))
    found = EVERY_METRIC.find(selector.name)
    return verdicts_on_metric(EVERY_METRIC.shipped[selector.name] if found is None else found.value)


def _of_module(module: ModuleType, file: str, solver: str | None) -> Iterator[Subject]:
    """Yield every plug-in that a file defines."""
    own = {name: kind_of_value(value) for name, value in own_names(module).items()}
    found = {name: kind for name, kind in own.items() if kind is not None}
    if not found:
        raise DikbenchError(f"{file} holds nothing to check; valid: {', '.join(IN_WORDS.values())}")
    for name, kind in found.items():
        selector = Selector(f"{file}:{name}")
        yield f"{kind} {selector}", _verdicts(kind, selector, solver)


def _of_project(folder: Path, solver: str | None) -> Iterator[Subject]:
    """Yield every plug-in that a project names in its entry points."""
    file = folder / PROJECT
    try:
        project = tomllib.loads(file.read_text(encoding="utf-8")).get("project", {})
    except OSError as error:
        raise DikbenchError(f"{file}: {error.strerror or error}; valid: a project") from None
    except (tomllib.TOMLDecodeError, UnicodeDecodeError) as error:
        raise DikbenchError(f"{file}: not valid TOML: {error}") from None
    groups: dict[str, Any] = project.get("entry-points", {})
    ours = [
        EntryPoint(name, str(value), group)
        for group, points in groups.items()
        if group in {f"dikbench.{each}" for each in TABLES.values()} and isinstance(points, dict)
        for name, value in points.items()
    ]
    if not ours:
        valid = ", ".join(f"dikbench.{group}" for group in dict.fromkeys(TABLES.values()))
        raise DikbenchError(f"{file}: no entry points of dikbench; valid: {valid}")
    try:
        with entry_points_added(ours, [folder / "src", folder]):
            plugins.cache_clear()
            for kind in IN_WORDS:
                if any(point.group == f"dikbench.{TABLES[kind]}" for point in ours):
                    for named in entries_of(kind, ours):
                        selector = Selector(named.name)
                        yield f"{kind} {selector}", _verdicts(kind, selector, solver)
    finally:
        plugins.cache_clear()
