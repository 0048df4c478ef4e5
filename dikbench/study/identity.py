"""Ids of trials: hashes of everything that a trial consists of."""

from __future__ import annotations

import json
import os.path
from collections.abc import Iterable, Mapping
from dataclasses import astuple, fields, is_dataclass
from functools import lru_cache
from importlib.metadata import PackageNotFoundError, version
from types import MappingProxyType
from typing import Any, Final

from dikbench.errors import DikbenchError
from dikbench.plugins.building import make_formulation, make_plant, scenario_parameters
from dikbench.plugins.finding import formulation_plugin, plant_plugin, scenario_plugin
from dikbench.plugins.source import digest, digest_of_file, digest_of_module, source_digest
from dikbench.problem.progress import CHARACTERISTIC_LENGTH_M
from dikbench.robots.plugged import EVERY_ROBOT
from dikbench.scenario.oracle import ORACLES
from dikbench.scenario.plant import PLANTS
from dikbench.selector import Selector, parse_selector
from dikbench.solvers.catalogue.back_ends import Solver, find_back_end, parse_solver
from dikbench.study.trial import NO_SOLVER, Trial
from dikbench.user_code import Named, in_file

ADDED: Final[Mapping[str, Any]] = MappingProxyType(
    {"characteristic_length": CHARACTERISTIC_LENGTH_M}
)
"""Parameters that all families got when results were stored already, and what held before: at these
values ids stay what they were."""


def trial_id(trial: Trial) -> str:
    """Return the id of a trial, 16 hexadecimal digits.

    It is a hash of the formulation and the scenario family with their parameters and sources (see
    `source_digest`), the solver with its interface and settings, the plant, the reference mode and
    the seed; of the sources of a robot, a solver and a plant as well, where they are of another
    author. Selectors with the same meaning, such as an explicit default, give the same id.

    Raises:
        DikbenchError: if a selector does not name anything valid.
    """
    cell = timing_id(trial.formulation, trial.solver, trial.scenario)
    how = (*_plant(trial.plant), trial.reference, trial.seed)
    return digest(json.dumps((cell, *how)))


def timing_id(formulation: Selector, solver: Selector, scenario: Selector) -> str:
    """Return the id of what is timed: `trial_id` without how a trial is run."""
    return digest(json.dumps((_formulation(formulation), _solver(solver), scenario_id(scenario))))


def sources_of(trials: Iterable[Trial]) -> dict[str, str]:
    """Return a hash for each name among trials, of all in their ids that was given it.

    Two processes that have the same trials in mind have the same hashes, if they have the same
    sources; the names of those that differ say what is another one.
    """
    found: dict[str, dict[str, None]] = {}
    for trial in trials:
        for (axis, name), text in parts_of(trial).items():
            found.setdefault(f"{axis} {name}", {})[text] = None
    return {name: digest(json.dumps(sorted(texts))) for name, texts in sorted(found.items())}


def parts_of(trial: Trial) -> dict[tuple[str, str], str]:
    """Return the ids of the parts of a trial by axis and name."""
    return {
        ("formulation", trial.formulation.name): _formulation(trial.formulation),
        ("solver", trial.solver.name): _solver(trial.solver),
        ("scenario", trial.scenario.name): scenario_id(trial.scenario),
        ("plant", trial.plant.name): json.dumps(_plant(trial.plant)),
    }


def trial_id_today(row: Mapping[str, Any]) -> str | None:
    """Return the id that the trial of a row has today; None where a part of it is gone."""
    try:
        return trial_id(Trial.of(**row))
    except DikbenchError:  # the formulation's file is gone, the scenario has another parameter
        return None


def timing_id_today(formulation: str, solver: str, scenario: str) -> str | None:
    """Return the id that what was timed has today; None where a part of it is gone."""
    try:
        return timing_id(*map(parse_selector, (formulation, solver, scenario)))
    except DikbenchError:
        return None


@lru_cache(maxsize=4096)
def _formulation(selector: Selector) -> str:
    if selector.name in ORACLES:
        return selector.name
    made = make_formulation(selector)
    plugin = formulation_plugin(selector.name)
    names: list[str] = [field.name for field in fields(made)] if is_dataclass(made) else []
    values = {name: repr(getattr(made, name)) for name in names}
    return digest(
        json.dumps([type(made).__qualname__, values, source_digest(plugin)], sort_keys=True)
    )


@lru_cache(maxsize=65536)
def scenario_id(selector: Selector) -> str:
    """Return the id of a scenario: family, parameters and source version, without the seed."""
    parameters = scenario_parameters(selector)
    values = {
        key: _described(value)
        for key, value in parameters.items()
        if key not in ADDED or value != ADDED[key]
    }
    robot = parameters["robot"]
    if (in_file(robot) or robot in EVERY_ROBOT) and (found := EVERY_ROBOT.find(robot)) is not None:
        values["robot"] += f" {_source(found)}"
    plugin = scenario_plugin(selector.name)
    return digest(json.dumps([selector.name, values, source_digest(plugin)], sort_keys=True))


@lru_cache(maxsize=4096)
def _solver(selector: Selector) -> str:
    if selector == NO_SOLVER:
        return selector.name
    solver = parse_solver(selector)
    return digest(json.dumps(_described_solver(solver), sort_keys=True))


def _described_solver(solver: Solver) -> list[Any]:
    settings = {key: repr(value) for key, value in solver.settings.items()}
    then = [] if solver.then is None else [_described_solver(solver.then)]
    own = find_back_end(solver.name)
    source = [] if own.found is None else [_source(own.found), _version(own.package)]
    return [solver.name, solver.interface, settings, solver.tolerance, *source, *then]


@lru_cache(maxsize=4096)
def _plant(selector: Selector) -> tuple[Any, ...]:
    plant = (selector.name, *astuple(make_plant(selector)))
    if selector.name not in PLANTS:
        plant += (source_digest(plant_plugin(selector.name)),)
    return plant


def _source(found: Named) -> str:
    return digest_of_module(found.module, found.file)


def _version(distribution: str) -> str:
    """Return the version of a distribution that a solver names; empty where it has none."""
    try:
        return version(distribution)
    except (PackageNotFoundError, ValueError):
        return ""


def _described(value: Any) -> str:
    """Write a parameter's value; of a file that it names, the contents as well."""
    if isinstance(value, str) and os.path.isfile(value):
        return f"{value!r} {digest_of_file(value)}"
    return repr(value)
