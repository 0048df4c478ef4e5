"""The descriptions of single things: formulations, families, solvers, plants, robots, ..."""

from __future__ import annotations

import inspect
import shlex
from collections.abc import Mapping
from math import isnan
from pathlib import Path
from types import MappingProxyType
from typing import Final

from dikbench.annotations import type_in_words
from dikbench.cli.kinds import kind_named
from dikbench.cli.listing import ORACLE_SUMMARIES, direction
from dikbench.cli.robot_in_words import ROBOT_FILES, robot_in_words
from dikbench.errors import DikbenchError, unknown
from dikbench.metrics import EVERY_METRIC, OUTCOME_SENTENCES, Metric, Outcome, other_metrics
from dikbench.plugins.building import make_formulation, make_plant, make_scenario
from dikbench.plugins.finding import (
    Plugin,
    formulation_plugin,
    formulations_and_peers,
    plant_plugin,
    plugins,
    scenario_plugin,
)
from dikbench.published.experiment import load_experiment, published_experiments
from dikbench.report.tables.every import tables_with
from dikbench.robots.plugged import EVERY_ROBOT
from dikbench.scenario.oracle import ORACLES
from dikbench.scenario.plant import REFERENCE_MODES
from dikbench.scenario.scenario import Scenario
from dikbench.selector import Selector, listed, parse_selector
from dikbench.solvers.catalogue.back_ends import (
    DEFAULT_SOLVER,
    SOLVERS,
    find_back_end,
    is_installed,
    parse_solver,
    presets_of,
)
from dikbench.study.instances import draw_instance
from dikbench.study.study import load_study, shipped_studies

FEASIBLE: Final[Mapping[str, str]] = MappingProxyType(
    {
        "time": "a motion is known that keeps all limits by the clock",
        "path": "a motion is known that keeps all limits if the path may wait",
        "no": "there is a proof that no motion keeps all limits",
        "unknown": "neither a motion is known nor a proof that there is none",
    }
)
"""What the words of `feasible` mean."""


def description(text: str) -> str:
    """Describe one thing in full.

    Raises:
        DikbenchError: if nothing has this name, or a parameter of it is wrong.
    """
    selector = parse_selector(text)
    name = selector.name
    kind = kind_named(name)
    if kind == "formulation":
        return _described(formulation_plugin(name), selector)
    if kind == "scenario":
        return _described(scenario_plugin(name), selector, scenario=True)
    if kind == "solver":
        return _solver(selector)
    if kind == "plant":
        make_plant(selector)
        return _plugin(plant_plugin(name), selector, "")
    if kind == "robot" or name.endswith(ROBOT_FILES):
        return robot_in_words(name, selector.parameters)
    described = _metric(name) if kind == "metric" else _without_parameters(name)
    if selector.parameters:
        raise DikbenchError(
            f"{text}: {name} has no parameters; valid in brackets: those of a formulation, "
            "scenario, solver, plant or robot"
        )
    return described


def drawn_instance(text: str, number: int) -> str:
    """Describe an instance of a scenario: what was drawn, and how it runs.

    Raises:
        DikbenchError: if there is no such family, or it has no such instance.
    """
    given = parse_selector(text)
    *rejected, drawn = draw_instance(given, number)
    command = shlex.join(
        ["dikbench", "run", "--scenario", drawn.scenario, "--seed", str(drawn.seed)]
    )
    return "\n".join(
        [
            f"Instance {number} of {given}:",
            f"  scenario: {drawn.scenario}",
            f"  seed: {drawn.seed}",
            f"  rejected before it: {len(rejected)}",
            *(f"    {each.scenario}, seed {each.seed}: {each.rejected}" for each in rejected),
            f"  it runs with: {command}",
        ]
    )


def _without_parameters(name: str) -> str:
    if name in ORACLES:
        return f"{name}: {ORACLE_SUMMARIES[name]}"
    if name in {outcome.value for outcome in Outcome}:
        return f"{name}: {OUTCOME_SENTENCES[Outcome(name)]}"
    if name in shipped_studies() or name.endswith(".toml"):
        study = load_study(name)
        path = shipped_studies().get(name, name)
        return f"# {study.name} ({path})\n\n{Path(path).read_text(encoding='utf-8')}"
    if name in published_experiments():
        return _published(name)
    every = [
        *formulations_and_peers(),
        *plugins("scenario"),
        *SOLVERS.names(),
        *plugins("plant"),
        *EVERY_ROBOT.names(),
        *EVERY_METRIC.names(),
        *published_experiments(),
    ]
    raise unknown("name", name, [*every, *shipped_studies()], every="dikbench list")


def _published(name: str) -> str:
    """Describe a published experiment: its source, what is done, its rows, what is known of it."""
    experiment = load_experiment(name)
    rows = [
        f"  {row.name}: {row.formulation or f'not covered: {row.not_covered}'}"
        for row in experiment.rows
    ]
    return "\n".join(
        [
            f"{name}: {experiment.title}",
            f"source: {experiment.source}",
            "",
            *(inspect.getdoc(type(experiment.protocol)) or "").splitlines(),
            "",
            "Rows, each with our formulation:",
            *rows,
            *(text for note in experiment.notes for text in ("", note)),
            "",
            f"It is run by: dikbench reproduce {name}",
        ]
    )


def _described(plugin: Plugin, selector: Selector, *, scenario: bool = False) -> str:
    """Describe a formulation or a family; a scenario of it where all is given that must be."""
    lacking = [p for p in plugin.parameters.values() if p.required]
    lacking = [p for p in lacking if p.name not in selector.parameters]
    further = []
    if lacking:
        given = {**selector.parameters, **{p.name: "..." for p in lacking}}
        wanted = ", ".join(p.name for p in lacking)
        further = ["", f"{wanted} must be given: {Selector(selector.name, given)}"]
    elif scenario:
        further = ["", *_difficulty(selector)]
    else:
        make_formulation(selector)
    return "\n".join([_plugin(plugin, selector, "instances" if scenario else "tuned"), *further])


def _plugin(plugin: Plugin, selector: Selector, drawn: str) -> str:
    """Describe a plug-in by its docstring and parameters.

    Args:
        plugin: what is described.
        selector: as it was named, with its values.
        drawn: what the ranges are for in which parameters are drawn.
    """
    given = selector.parameters
    values = {
        p.name: f" = {given[p.name]} (default: {'none' if p.required else p.default})"
        if p.name in given
        else ""
        if p.required
        else f" = {p.default}"
        for p in plugin.parameters.values()
    }
    parameters = [
        f"  {p.name}{values[p.name]}: {p.valid}" + (f"  ({drawn}: {p.drawn})" if p.drawn else "")
        for p in plugin.parameters.values()
        if not p.hidden
    ]
    return "\n".join(
        [
            f"{plugin.name} ({plugin.file})",
            "",
            inspect.getdoc(plugin.factory) or "",
            "",
            "Parameters:",
            *(parameters or ["  none"]),
        ]
    )


def _difficulty(text: Selector) -> list[str]:
    """Describe a scenario's certificate and what its exact joint motion asks of the robot."""
    scenario = make_scenario(text)
    lines = [f"Certificate of {text}:", *(f"  {claim}" for claim in scenario.certificate.claims)]
    motion = scenario.motion
    if motion is None:
        still = "Its target is at rest: how to get to it is up to a formulation."
        moves = scenario.reference.moving
        lines += ["", "No joint motion follows its reference." if moves else still]
    else:
        sigma, margin, reach = motion.sigma_min, motion.margin, motion.reach
        lines += [
            "",
            f"The exact joint motion, in {len(motion.instants)} samples "
            f"({scenario.duration:.4g} s, {scenario.steps} control steps):",
            f"  smallest singular value (m, rad): {sigma.min():.4g} to {sigma.max():.4g}",
            f"  margin to the position limits [rad]: {margin.min():.4g} to {margin.max():.4g}",
            f"  required speed over limit: up to {motion.peak_speed_ratio:.4g}",
            f"  reach from the first joint [m]: {reach.min():.4g} to {reach.max():.4g}",
        ]
    return [*lines, "", *_verdict(scenario), "", f"A seed perturbs: {scenario.variation}."]


def _verdict(scenario: Scenario) -> list[str]:
    """Describe by what a scenario's trials are judged, what can be done of it, and the words."""
    witness, until = scenario.witness, scenario.followable_until
    feasible = f"{scenario.feasible}, {FEASIBLE[scenario.feasible]}"
    if scenario.feasible == "path" and witness is not None:
        feasible += f", {witness.lateness:.3g} s late"
    if scenario.infeasible_because:
        feasible += f": {scenario.infeasible_because}"
    need = "not defined" if isnan(scenario.need) else f"{scenario.need:.4g}"
    end = "its end can be reached" if scenario.comes_back else "its end cannot be reached"
    return [
        "How its trials are judged:",
        f"  situation: {scenario.situation}",
        f"  judged by: {'the whole path' if scenario.judged == 'path' else 'where it ends'}",
        f"  tolerance [m]: {scenario.tolerance_m:g}",
        f"  feasible: {feasible}",
        f"  need (joint speed of the exact motion over its limit): {need}",
        "  can be followed until: " + ("its end" if until is None else f"{until:.4g} s; {end}"),
        "",
        "What the words mean:",
        *_meanings("feasible", FEASIBLE),
        *_meanings("reference", REFERENCE_MODES),
        *_meanings("outcome", {each.value: text for each, text in OUTCOME_SENTENCES.items()}),
    ]


def _meanings(of: str, words: Mapping[str, str]) -> list[str]:
    return [f"  {of} {word}: {meaning}" for word, meaning in words.items()]


def _solver(selector: Selector) -> str:
    name, entry = selector.name, find_back_end(selector.name)
    if selector.parameters:
        parse_solver(selector)
    known = presets_of(entry)
    presets = ", ".join(f"{preset} {tolerance:g}" for preset, tolerance in known.items())
    settings = ", ".join(f"{key} ({type_in_words(kind)})" for key, kind in entry.settings.items())
    return "\n".join(
        [
            f"{name}: {entry.summary}",
            *([] if entry.found is None else [f"  file: {entry.found.file}"]),
            f"  package: {entry.package}, {'installed' if is_installed(name) else 'missing'}"
            if entry.package
            else "  package: none is named",
            f"  interfaces: {', '.join(entry.interfaces)} (the first is the default)",
            f"  linear programs: {entry.no_lp or 'yes'}",
            f"  presets: {presets} (largest residual of a verified answer)",
            f"  settings: {settings or 'none'}",
            f"  then: another solver, asked where {name} gives no answer, as in {name}[then=...]",
            *(
                f"  the default of formulations with a program of kind {program}: {default}"
                for program, default in DEFAULT_SOLVER.items()
                if parse_selector(default).name == name
            ),
            *([f"  selected: {listed(selector.parameters)}"] if selector.parameters else []),
        ]
    )


def _metric(name: str) -> str:
    found = EVERY_METRIC.find(name)
    if found is None:
        return _described_metric(EVERY_METRIC.shipped[name])
    others = [_described_metric(metric) for metric, _, _ in other_metrics([name])]
    return "\n\n".join(f"{each}\n  file: {found.file}" for each in others)


def _described_metric(metric: Metric) -> str:
    tables = ", ".join(tables_with(metric.name))
    return "\n".join(
        [
            f"{metric.name}: {metric.definition}",
            f"  unit: {metric.unit or 'none'}; {direction(metric)}; worst value {metric.worst}",
            f"  tables: {tables or 'none; a column of trials.csv'}",
            f"  source: {metric.source.strip('[]')}",
        ]
    )
