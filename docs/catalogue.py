"""The reference pages that are written from docstrings and annotations when the site is built."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterable, Mapping
from pathlib import Path
from types import MappingProxyType
from typing import Final

import click

from dikbench.cli import commands
from dikbench.cli.describing import description
from dikbench.cli.listing import direction
from dikbench.metrics import METRICS, OUTCOME_SENTENCES
from dikbench.plugins.building import make_scenario
from dikbench.plugins.finding import Plugin, plugins
from dikbench.problem.problem import is_batched, is_strict, program_of, promises_of, sight_of
from dikbench.report.contents.docstring import Docstring, parse_docstring
from dikbench.robots.plugged import EVERY_ROBOT
from dikbench.scenario.plant import PLANTS
from dikbench.solvers.catalogue.back_ends import SOLVERS
from dikbench.study.study import shipped_studies

CHECKOUT: Final = Path(__file__).parents[1]
REFERENCES: Final = CHECKOUT / "formulations" / "REFERENCES.md"

GIVEN: Final = {"csv": "csv[file=teleoperation]"}
"""Selectors of families that have no default."""


def prose(text: str) -> str:
    """Write a docstring's text in Markdown: symbols mean themselves, keys of papers are links."""
    pieces = re.split(r"(`[^`]*`)", text)
    for number in range(0, len(pieces), 2):
        escaped = re.sub(r"([\\*_<>|$~^#])", r"\\\1", pieces[number])
        pieces[number] = re.sub(
            r"\[(\w+)\]",
            lambda key: f"{{ref}}`[{key[1]}] <{label(key[1])}>`" if key[1] in keys() else key[0],
            escaped,
        )
    return "".join(pieces)


def keys() -> Mapping[str, str]:
    """Read the works that docstrings cite, by key."""
    text = REFERENCES.read_text(encoding="utf-8")
    return dict(re.findall(r"^- \*\*\[(\w+)\]\*\* (.+)$", text, re.M))


def label(key: str) -> str:
    """Name a work's place on the page of references."""
    return f"reference-{key.lower()}"


def references() -> str:
    """Write the page of references."""
    return "\n\n".join(f"({label(key)})=\n**[{key}]** {work}" for key, work in keys().items())


def table(head: Iterable[str], rows: Iterable[Iterable[str]]) -> str:
    """Write a table in Markdown."""
    lines = [" | ".join(head)]
    lines.append(" | ".join("---" for _ in lines[0].split(" | ")))
    lines += [" | ".join(cell or " " for cell in row) for row in rows]
    return "\n".join(f"| {line} |" for line in lines)


def body(docstring: Docstring) -> str:
    """Write summary and paragraphs of a docstring, programs as they are set."""
    shown = [prose(docstring.summary)]
    for part in docstring.paragraphs:
        shown.append(f"```text\n{part.text}\n```" if part.program else prose(part.text))
    return "\n\n".join(shown)


def parameters(plugin: Plugin, entries: Mapping[str, str], drawn: str) -> str:
    """Write the table of a plug-in's parameters."""
    rows = [
        (
            f"`{each.name}`",
            "" if each.required else f"`{each.default}`",
            prose(each.valid),
            prose(str(each.drawn or "")),
            prose(entries.get(each.name, "")),
        )
        for each in plugin.parameters.values()
        if not each.hidden
    ]
    return table(("parameter", "default", "valid", drawn, "what it is"), rows) if rows else ""


def formulations() -> str:
    """Write every formulation: its program, what it keeps and sees, its parameters, its source."""
    shown = []
    for plugin in plugins("formulation").values():
        docstring = parse_docstring(plugin.factory.__doc__ or "")
        made = plugin.factory(**plugin.defaults)
        facts = [
            f"asks a solver for a program of kind `{program_of(made)}`" if program_of(made) else "",
            f"keeps {_listed(promises_of(made))}",
            f"sees {_listed(sight_of(made))}",
            "lower tasks cost the first priority nothing" if is_strict(made) else "",
            "answers many control steps at once" if is_batched(made) else "",
        ]
        shown += [
            f"## {plugin.name}",
            body(docstring),
            f"It {'; '.join(filter(None, facts))}.",
            parameters(plugin, docstring.entries, "tuned"),
            f"Source: {prose(plugin.source)}." if plugin.source else "",
        ]
    return "\n\n".join(filter(None, shown))


def _listed(words: Iterable[str]) -> str:
    return ", ".join(f"`{word}`" for word in sorted(words)) or "no limits or further tasks"


def scenarios() -> str:
    """Write every family: what it provokes, its parameters with ranges, its certificate."""
    shown = []
    for plugin in plugins("scenario").values():
        docstring = parse_docstring(plugin.factory.__doc__ or "")
        selector = GIVEN.get(plugin.name, plugin.name)
        scenario = make_scenario(selector)
        claims = "\n".join(f"- {prose(str(claim))}" for claim in scenario.certificate.claims)
        shown += [
            f"## {plugin.name}",
            body(docstring),
            *(f"{title}: {prose(text)}." for title, text in docstring.titled.items()),
            parameters(plugin, docstring.entries, "instances"),
            f"Certificate of `{selector}`, which is {scenario.situation} and feasible: "
            f"{scenario.feasible}:",
            claims or "- nothing is claimed",
        ]
    return "\n\n".join(filter(None, shown))


def metrics() -> str:
    """Write the table of every metric."""
    rows = [
        (
            f"`{metric.name}`",
            metric.unit or "",
            direction(metric),
            f"{metric.worst:g}",
            prose(metric.definition),
            "" if metric.source == "dikbench" else prose(metric.source),
        )
        for metric in METRICS.values()
    ]
    return table(("metric", "unit", "better", "worst", "what it is", "source"), rows)


def outcomes() -> str:
    """Write the table of outcomes, in the order in which they are asked for."""
    rows = [(f"`{each.value}`", prose(text)) for each, text in OUTCOME_SENTENCES.items()]
    return table(("outcome", "when"), rows)


def described(names: Iterable[str]) -> str:
    """Write what `dikbench show` prints of things, a section each."""
    return "\n\n".join(
        f"## {name}\n\n```text\n{description(name).replace(str(CHECKOUT), '')}\n```"
        for name in names
    )


def command_line() -> str:
    """Write the help of every command, as it prints it."""
    shown = [f"## dikbench\n\n```text\n{_help(commands, 'dikbench')}\n```"]
    for name, command in sorted(commands.commands.items()):
        shown.append(f"## dikbench {name}\n\n```text\n{_help(command, f'dikbench {name}')}\n```")
    return "\n\n".join(shown)


def _help(command: click.Command, name: str) -> str:
    context = click.Context(command, info_name=name, max_content_width=100, terminal_width=100)
    return command.get_help(context)


PAGES: Final[Mapping[str, Callable[[], str]]] = MappingProxyType(
    {
        "every-formulation": formulations,
        "every-scenario": scenarios,
        "every-metric": metrics,
        "every-outcome": outcomes,
        "every-plant": lambda: described(PLANTS),
        "every-study": lambda: described(shipped_studies()),
        "every-solver": lambda: described(SOLVERS.names()),
        "every-robot": lambda: described(EVERY_ROBOT.names()),
        "every-command": command_line,
        "every-reference": references,
    }
)
"""What each directive of the site writes."""
