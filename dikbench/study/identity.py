"""What a trial is made of, as a hash: the same trial has the same id in any process, on any day."""

from __future__ import annotations

import json
import os.path
from dataclasses import fields, is_dataclass
from functools import lru_cache
from typing import Any

from dikbench.plugins.building import make_formulation, make_plant, scenario_parameters
from dikbench.plugins.finding import formulation_plugin, scenario_plugin
from dikbench.plugins.source import digest, digest_of_file, source_digest
from dikbench.scenario.oracle import ORACLE
from dikbench.selector import parse_selector
from dikbench.solvers.catalogue.back_ends import parse_solver
from dikbench.study.trial import NO_SOLVER, Trial


def trial_id(trial: Trial) -> str:
    """The id of a trial, 16 hexadecimal digits.

    Made of the law and its parameters, the scenario family and its parameters, both with the
    version of their source (see `source_digest`); the solver, how it is called and its settings;
    plant, reference mode and seed. Selectors that mean the same (a default that is spelt out) give
    the same id.

    Raises:
        DikbenchError: if a selector does not name anything valid.
    """
    cell = cell_id(trial.formulation, trial.solver, trial.scenario)
    plant = make_plant(trial.plant)
    how = (plant.drive.__name__, plant.noise, plant.delay, trial.reference, trial.seed)
    return digest(json.dumps((cell, *how)))


def cell_id(formulation: str, solver: str, scenario: str) -> str:
    """The id of a cell that is timed: what `trial_id` is made of, but for how a trial is run."""
    return digest(json.dumps((_formulation(formulation), _solver(solver), scenario_id(scenario))))


@lru_cache(maxsize=4096)
def _formulation(text: str) -> str:
    if text == ORACLE:
        return text
    law = make_formulation(text)
    plugin = formulation_plugin(parse_selector(text).name)
    names: list[str] = [field.name for field in fields(law)] if is_dataclass(law) else []
    values = {name: repr(getattr(law, name)) for name in names}
    return digest(
        json.dumps([type(law).__qualname__, values, source_digest(plugin)], sort_keys=True)
    )


@lru_cache(maxsize=65536)
def scenario_id(text: str) -> str:
    """The id of a scenario: its family, parameters and the version of its source, not its seed."""
    name = parse_selector(text).name
    values = {key: _described(value) for key, value in scenario_parameters(text).items()}
    return digest(json.dumps([name, values, source_digest(scenario_plugin(name))], sort_keys=True))


@lru_cache(maxsize=4096)
def _solver(text: str) -> str:
    if text == NO_SOLVER:
        return text
    solver = parse_solver(text)
    settings: dict[str, Any] = {key: repr(value) for key, value in solver.settings.items()}
    return digest(
        json.dumps([solver.name, solver.interface, settings, solver.tolerance], sort_keys=True)
    )


def _described(value: Any) -> str:
    """A parameter's value; of a file that it names, the contents as well."""
    if isinstance(value, str) and os.path.isfile(value):
        return f"{value!r} {digest_of_file(value)}"
    return repr(value)
