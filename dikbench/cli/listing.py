"""Lists of formulations, families, solvers, robots, metrics, outcomes and studies."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from types import MappingProxyType
from typing import Final

from dikbench.metrics import EVERY_METRIC, METRICS, OUTCOME_SENTENCES, Metric, other_metrics
from dikbench.plugins.finding import Plugin, plugins
from dikbench.plugins.source import SHARED_PACKAGES
from dikbench.problem.problem import not_installed
from dikbench.published.experiment import load_experiment, published_experiments
from dikbench.robots.plugged import EVERY_ROBOT, robot_entry
from dikbench.scenario.oracle import ORACLE, SLOWED_ORACLE
from dikbench.scenario.plant import PLANTS
from dikbench.solvers.catalogue.back_ends import SOLVERS, find_back_end, is_installed
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
            (formulation.name, formulation.summary.rstrip("."), _with_file(formulation))
            for formulation in formulations
        ),
        *((name, summary, "") for name, summary in ORACLE_SUMMARIES.items()),
        *(
            (peer.name, peer.summary.rstrip("."), _how_to_install(peer) or peer.source)
            for peer in plugins("peer").values()
        ),
    ]


def _how_to_install(peer: Plugin) -> str:
    """Say in brackets how the library of a peer is installed; or nothing, where it is."""
    missing = not_installed(peer.factory)
    return f"[{missing}]" if missing else ""


def _scenarios() -> list[tuple[str, str, str]]:
    """List what each family provokes and which metrics show it; else its summary."""
    return [
        (
            f.name,
            f.paragraph("Provokes") or f.summary.rstrip("."),
            "; ".join(filter(None, (f.paragraph("Shows in"), _file_of_others(f)))),
        )
        for f in plugins("scenario").values()
    ]


def _with_file(plugin: Plugin) -> str:
    """Say of which paper a plug-in is, and in which file it is where that is not of dikbench."""
    return "; ".join(filter(None, (plugin.source, _file_of_others(plugin))))


def _file_of_others(plugin: Plugin) -> str:
    """Return the file of a plug-in that does not come with dikbench; else an empty text."""
    shipped = plugin.factory.__module__.partition(".")[0] in SHARED_PACKAGES
    return "" if shipped else plugin.file


def _solvers() -> list[tuple[str, str, str]]:
    return [
        (name, find_back_end(name).summary, "" if is_installed(name) else "not installed")
        for name in SOLVERS.shipped
    ] + [
        (name, find_back_end(name).summary, found.file) for name, found in SOLVERS.others().items()
    ]


def _metrics() -> list[tuple[str, str, str]]:
    others = [(each, other) for each in EVERY_METRIC.others() for other in other_metrics([each])]
    return [
        *((m.name, m.definition, direction(m)) for m in METRICS.values()),
        *(
            (name, m.definition, f"{direction(m)}; {EVERY_METRIC.others()[name].file}")
            for name, (m, _, _) in others
        ),
    ]


def _plants() -> list[tuple[str, str, str]]:
    return [
        (name, plant.summary.rstrip("."), "" if name in PLANTS else plant.file)
        for name, plant in plugins("plant").items()
    ]


def _robots() -> list[tuple[str, str, str]]:
    others = EVERY_ROBOT.others()
    return [
        (name, robot_entry(name).summary, others[name].file if name in others else "")
        for name in EVERY_ROBOT.names()
    ]


def direction(metric: Metric) -> str:
    """Say which direction of a metric is better."""
    return "lower is better" if metric.best == "low" else "higher is better"


_SUBJECTS: Mapping[str, Callable[[], list[tuple[str, str, str]]]] = {
    "formulations": _formulations,
    "scenarios": _scenarios,
    "solvers": _solvers,
    "plants": _plants,
    "robots": _robots,
    "metrics": _metrics,
    "outcomes": lambda: [(each.value, text, "") for each, text in OUTCOME_SENTENCES.items()],
    "studies": lambda: [(n, load_study(n).description, "") for n in shipped_studies()],
    "published": lambda: [
        (name, load_experiment(name).title, load_experiment(name).source)
        for name in published_experiments()
    ],
}
