"""Lists of formulations, families, solvers, robots, metrics, outcomes and studies."""

from __future__ import annotations

import inspect
from collections.abc import Callable, Mapping
from types import MappingProxyType
from typing import Final

from dikbench.metrics import METRICS, OUTCOME_SENTENCES, Metric
from dikbench.plugins.finding import Plugin, plugins
from dikbench.problem.problem import not_installed
from dikbench.published.experiment import load_experiment, published_experiments
from dikbench.robots.catalogue import ROBOTS
from dikbench.scenario.oracle import ORACLE, SLOWED_ORACLE
from dikbench.scenario.plant import PLANTS
from dikbench.solvers.catalogue.back_ends import BACK_ENDS, is_installed
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
        *(
            (peer.name, peer.summary.rstrip("."), not_installed(peer.factory) or peer.source)
            for peer in plugins("peer").values()
        ),
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
    return [(m.name, m.definition, direction(m)) for m in METRICS.values()]


def direction(metric: Metric) -> str:
    """Say which direction of a metric is better."""
    return "lower is better" if metric.best == "low" else "higher is better"


_SUBJECTS: Mapping[str, Callable[[], list[tuple[str, str, str]]]] = {
    "formulations": _formulations,
    "scenarios": _scenarios,
    "solvers": _solvers,
    "plants": lambda: [(name, plant_plugin(name).summary.rstrip("."), "") for name in PLANTS],
    "robots": lambda: [(name, entry.summary, "") for name, entry in ROBOTS.items()],
    "metrics": _metrics,
    "outcomes": lambda: [(each.value, text, "") for each, text in OUTCOME_SENTENCES.items()],
    "studies": lambda: [(n, load_study(n).description, "") for n in shipped_studies()],
    "published": lambda: [
        (name, load_experiment(name).title, load_experiment(name).source)
        for name in published_experiments()
    ],
}


def plant_plugin(name: str) -> Plugin:
    """Describe a plant as what is registered is described."""
    return Plugin(name, PLANTS[name], inspect.getsourcefile(PLANTS[name]) or "")
