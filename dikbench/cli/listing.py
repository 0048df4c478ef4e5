"""Lists of formulations, families, solvers, robots, metrics and studies, and their descriptions."""

from __future__ import annotations

import inspect
from collections.abc import Callable, Mapping
from pathlib import Path
from types import MappingProxyType
from typing import Final

import numpy as np

from dikbench.errors import DikbenchError, unknown
from dikbench.metrics import METRICS, OUTCOME_SENTENCES, Metric, Outcome
from dikbench.plugins.building import make_formulation, make_plant, make_scenario
from dikbench.plugins.finding import (
    Plugin,
    formulation_plugin,
    in_file,
    kind_in_file,
    plugins,
    scenario_plugin,
)
from dikbench.report.tables.every import tables_with
from dikbench.robots.catalogue import ROBOTS
from dikbench.robots.loading import load_robot
from dikbench.scenario.oracle import ORACLE, ORACLES, SLOWED_ORACLE
from dikbench.scenario.plant import PLANTS
from dikbench.scenario.scenario import Scenario
from dikbench.selector import Selector, listed, parse_selector
from dikbench.solvers.catalogue.back_ends import (
    BACK_ENDS,
    DEFAULT_SOLVER,
    is_installed,
    parse_solver,
)
from dikbench.solvers.catalogue.presets import TOLERANCES
from dikbench.study.study import load_study, shipped_studies

ORACLE_SUMMARIES: Final = MappingProxyType(
    {
        ORACLE: "Not a formulation: the exact joint motion of a scenario, scored like one",
        SLOWED_ORACLE: "Not a formulation: a joint motion slowed down until it keeps all limits",
    }
)


def listing(subject: str) -> list[str]:
    """List the things of one kind, a line each: name, what it is, source."""
    return _aligned(_SUBJECTS[subject]())


def _aligned(rows: list[tuple[str, str, str]]) -> list[str]:
    width = max(len(name) for name, _, _ in rows)
    return [
        f"{name:<{width}}  {summary} {_bracketed(source)}".rstrip()
        for name, summary, source in rows
    ]


def _bracketed(source: str) -> str:
    """Put a source in brackets; keys of the references page have theirs already."""
    return f"[{source}]" if source and "[" not in source else source


def _formulations() -> list[tuple[str, str, str]]:
    formulations = plugins("formulation").values()
    return [
        *(
            (formulation.name, formulation.summary.rstrip("."), formulation.source)
            for formulation in formulations
        ),
        *((name, summary, "") for name, summary in ORACLE_SUMMARIES.items()),
    ]


def _scenarios() -> list[tuple[str, str, str]]:
    """List what each family provokes and which metrics show it; else its summary."""
    return [
        (f.name, f.paragraph("Provokes") or f.summary.rstrip("."), f.paragraph("Shows in"))
        for f in plugins("scenario").values()
    ]


def _solvers() -> list[tuple[str, str, str]]:
    return [
        (name, entry.summary, "" if is_installed(name) else "not installed")
        for name, entry in BACK_ENDS.items()
    ]


def _metrics() -> list[tuple[str, str, str]]:
    return [(m.name, m.definition, _direction(m)) for m in METRICS.values()]


def _direction(metric: Metric) -> str:
    return "lower is better" if metric.best == "low" else "higher is better"


_SUBJECTS: Mapping[str, Callable[[], list[tuple[str, str, str]]]] = {
    "formulations": _formulations,
    "scenarios": _scenarios,
    "solvers": _solvers,
    "plants": lambda: [(name, _plant(name).summary.rstrip("."), "") for name in PLANTS],
    "robots": lambda: [(name, entry.summary, "") for name, entry in ROBOTS.items()],
    "metrics": _metrics,
    "outcomes": lambda: [(each.value, text, "") for each, text in OUTCOME_SENTENCES.items()],
    "studies": lambda: [(n, load_study(n).description, "") for n in shipped_studies()],
}


def description(text: str) -> str:
    """Describe one thing in full.

    Raises:
        DikbenchError: if nothing has this name, or a parameter of it is wrong.
    """
    selector = parse_selector(text)
    name = selector.name
    kind = kind_in_file(name) if in_file(name) else None
    if kind == "formulation" or name in plugins("formulation"):
        make_formulation(selector)
        return _plugin(formulation_plugin(name), selector, "tuned")
    if kind == "scenario" or name in plugins("scenario"):
        difficulty = _difficulty(text)
        return "\n".join([_plugin(scenario_plugin(name), selector, "instances"), "", *difficulty])
    if name in BACK_ENDS:
        return _solver(selector)
    if name in PLANTS:
        make_plant(selector)
        return _plugin(_plant(name), selector, "")
    described = _without_parameters(name)
    if selector.parameters:
        raise DikbenchError(
            f"{text}: {name} has no parameters; valid in brackets: those of a formulation, "
            "scenario, solver or plant"
        )
    return described


def _without_parameters(name: str) -> str:
    if name in ORACLES:
        return f"{name}: {ORACLE_SUMMARIES[name]}"
    if name in ROBOTS:
        return _robot(name)
    if name in METRICS:
        return _metric(name)
    if name in {outcome.value for outcome in Outcome}:
        return f"{name}: {OUTCOME_SENTENCES[Outcome(name)]}"
    if name in shipped_studies() or name.endswith(".toml"):
        study = load_study(name)
        path = shipped_studies().get(name, name)
        return f"# {study.name} ({path})\n\n{Path(path).read_text(encoding='utf-8')}"
    every = [*plugins("formulation"), *plugins("scenario"), *BACK_ENDS, *PLANTS, *ROBOTS, *METRICS]
    raise unknown("name", name, [*every, *shipped_studies()], every="dikbench list")


def _plant(name: str) -> Plugin:
    return Plugin(name, PLANTS[name], inspect.getsourcefile(PLANTS[name]) or "")


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


def _difficulty(text: str) -> list[str]:
    """Describe a scenario's certificate and what its exact joint motion asks of the robot."""
    scenario = make_scenario(text)
    lines = [f"Certificate of {text}:", *(f"  {claim}" for claim in scenario.certificate.claims)]
    motion = scenario.motion
    if motion is None:
        lines += ["", "No joint motion follows its reference."]
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
    """Describe by what a scenario's trials are judged, and what can be done of it."""
    witness, until = scenario.witness, scenario.followable_until
    late = 0.0 if witness is None else witness.lateness
    known = {
        "time": "a motion is known that keeps all limits by the clock",
        "path": f"a motion is known that keeps all limits if the path may wait, {late:.3g} s late",
        "no": scenario.infeasible_because,
        "unknown": "neither a motion is known nor a proof that there is none",
    }[scenario.feasible]
    end = "its end can be reached" if scenario.comes_back else "its end cannot be reached"
    return [
        "How its trials are judged:",
        f"  situation: {scenario.situation}",
        f"  judged by: {'the whole path' if scenario.judged == 'path' else 'where it ends'}",
        f"  tolerance [m]: {scenario.tolerance_m:g}",
        f"  feasible: {known}",
        f"  need (joint speed of the exact motion over its limit): {scenario.need:.4g}",
        "  can be followed until: " + ("its end" if until is None else f"{until:.4g} s; {end}"),
    ]


def _solver(selector: Selector) -> str:
    name, entry = selector.name, BACK_ENDS[selector.name]
    if selector.parameters:
        parse_solver(selector)
    presets = ", ".join(f"{preset} {tolerance:g}" for preset, tolerance in TOLERANCES.items())
    settings = ", ".join(f"{key} ({kind.__name__})" for key, kind in entry.settings.items())
    return "\n".join(
        [
            f"{name}: {entry.summary}",
            f"  package: {entry.package}, {'installed' if is_installed(name) else 'missing'}",
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


def _robot(name: str) -> str:
    entry, robot = ROBOTS[name], load_robot(name)
    limits = robot.limits
    lines = [
        f"{name}: {entry.summary}",
        f"  task frame: {robot.frame}; {robot.nv} velocities",
        f"  safe start [rad]: {np.round(robot.q0, 4).tolist()}",
    ]
    if limits.position is not None:
        lines += [f"  position [rad]: {limits.position.lower.tolist()} to"]
        lines += [f"                  {limits.position.upper.tolist()}"]
    if limits.velocity is not None:
        lines.append(f"  velocity [rad/s]: {limits.velocity.upper.tolist()}")
    if robot.available_acceleration is not None:
        acceleration = robot.available_acceleration.tolist()
        lines.append(f"  acceleration [rad/s^2]: {acceleration} ({entry.acceleration_source})")
    return "\n".join(lines)


def _metric(name: str) -> str:
    metric = METRICS[name]
    tables = ", ".join(tables_with(name))
    return "\n".join(
        [
            f"{name}: {metric.definition}",
            f"  unit: {metric.unit or 'none'}; {_direction(metric)}; worst value {metric.worst}",
            f"  tables: {tables or 'none; a column of trials.csv'}",
            f"  source: {metric.source.strip('[]')}",
        ]
    )
