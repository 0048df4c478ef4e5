"""The command that checks a plug-in's contract. Heavy imports stand inside the command."""

from __future__ import annotations

import sys

import click

from dikbench.cli.one_line_errors import one_line_errors


@click.command()
@click.argument("name", metavar="SELECTOR")
@click.option(
    "--solver",
    metavar="SELECTOR",
    help="The solver with which a formulation is checked; default: that of its program.",
)
@one_line_errors
def check(name: str, solver: str | None) -> None:
    """Print which promises a formulation or a scenario family keeps, a line for each check.

    SELECTOR is a name with parameters where wanted, or 'path/to/file.py:Class[...]'. The exit code
    is 1 where a promise is broken.
    """
    from dikbench.errors import DikbenchError, unknown
    from dikbench.plugins.building import make_family, make_formulation
    from dikbench.plugins.finding import in_file, kind_in_file, plugins
    from dikbench.selector import parse_selector
    from dikbench.testing.verdicts import verdicts_on_family, verdicts_on_formulation

    plugin = parse_selector(name).name
    known = {plugin: kind_in_file(plugin)} if in_file(plugin) else {}
    known |= dict.fromkeys(plugins("formulation"), "formulation")
    known |= dict.fromkeys(plugins("scenario"), "scenario")
    if plugin not in known:
        where = "(or give path/to/file.py:Class)"
        raise unknown("formulation or scenario", plugin, known, where, "dikbench list")
    if known[plugin] == "formulation":
        verdicts = verdicts_on_formulation(make_formulation(name), solver)
    elif solver is not None:
        raise DikbenchError(f"--solver {solver}: {name} is a scenario family, which needs none")
    else:
        verdicts = verdicts_on_family(make_family(name))
    broken = False
    for verdict in verdicts:
        reason = f": {verdict.reason}" if verdict.reason else ""
        click.echo(f"{verdict.outcome:<12}  {verdict.check}{reason}")
        broken |= verdict.outcome == "BROKEN"
    sys.exit(1 if broken else 0)
