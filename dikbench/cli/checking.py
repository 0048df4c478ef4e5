"""The command that checks a plug-in's contract. Heavy imports stand inside the command."""

from __future__ import annotations

import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Final

import click

from dikbench.cli.one_line_errors import one_line_errors

MOST_PLACES: Final = 5
"""At most so many places are named where a study breaks an invariant."""

Line = tuple[str, str, str]
"""What came of a check, what was checked, and why it is broken."""


@click.command()
@click.argument("name", metavar="SELECTOR", required=False)
@click.option(
    "--solver",
    metavar="SELECTOR",
    help="The solver with which a formulation is checked; default: that of its program.",
)
@click.option(
    "--benchmark",
    metavar="STUDY",
    help="Run a study together with straw laws, and check that it keeps all invariants.",
)
@click.option(
    "--out",
    type=click.Path(path_type=Path, file_okay=False),
    metavar="DIR",
    help="Results folder of the study; default: runs/check-STUDY.",
)
@click.option(
    "--jobs",
    type=click.IntRange(min=1),
    metavar="N",
    help="Worker processes of the study; default: one per core.",
)
@one_line_errors
def check(
    name: str | None, solver: str | None, benchmark: str | None, out: Path | None, jobs: int | None
) -> None:
    """Print which promises a formulation or a scenario family keeps, a line for each check.

    SELECTOR is a name with parameters where wanted, or 'path/to/file.py:Class[...]'. The exit code
    is 1 where a promise is broken.

    With --benchmark it is a study that is checked: straw laws, which stand still, creep, shake or
    ignore all limits, must win nothing in it, and a known joint motion must succeed.
    """
    if (name is None) == (benchmark is None):
        raise click.UsageError("give a SELECTOR, or --benchmark STUDY")
    lines = _of_plugin(name, solver) if name else _of_study(str(benchmark), out, jobs)
    broken = False
    for outcome, what, reason in lines:
        click.echo(f"{outcome:<12}  {what}{f': {reason}' if reason else ''}")
        broken |= outcome == "BROKEN"
    sys.exit(1 if broken else 0)


def _of_study(benchmark: str, out: Path | None, jobs: int | None) -> Iterator[Line]:
    """Run a study with straw laws, and yield a line for each invariant."""
    import shlex

    from dikbench.invariants import check_benchmark
    from dikbench.run.in_workers import RunSettings
    from dikbench.run.pool import available_cores
    from dikbench.study.study import CHECKED, load_study

    study = load_study(benchmark)
    folder = out or Path("runs") / f"{CHECKED}{study.name}"
    settings = RunSettings(jobs=jobs or available_cores(), traces="none")
    command = shlex.join(["dikbench", *sys.argv[1:]])
    for checked in check_benchmark(study, folder, settings, command):
        if not checked.broken:
            yield "kept", checked.sentence, ""
        for place in checked.broken[:MOST_PLACES]:
            yield "BROKEN", checked.sentence, place
        if len(checked.broken) > MOST_PLACES:
            yield "BROKEN", checked.sentence, f"and {len(checked.broken) - MOST_PLACES} more"


def _of_plugin(name: str, solver: str | None) -> Iterator[Line]:
    """Yield a line for each check of a plug-in's contract."""
    from dikbench.errors import DikbenchError, unknown
    from dikbench.plugins.building import make_family, make_formulation
    from dikbench.plugins.finding import formulations_and_peers, in_file, kind_in_file, plugins
    from dikbench.problem.problem import not_installed
    from dikbench.selector import parse_selector
    from dikbench.testing.verdicts import verdicts_on_family, verdicts_on_formulation

    plugin = parse_selector(name).name
    known = {plugin: kind_in_file(plugin)} if in_file(plugin) else {}
    known |= dict.fromkeys(formulations_and_peers(), "formulation")
    known |= dict.fromkeys(plugins("scenario"), "scenario")
    if plugin not in known:
        where = "(or give path/to/file.py:Class)"
        raise unknown("formulation or scenario", plugin, known, where, "dikbench list")
    if known[plugin] == "formulation":
        formulation = make_formulation(name)
        if missing := not_installed(formulation):
            raise DikbenchError(f"formulation {name}: {missing}")
        verdicts = verdicts_on_formulation(formulation, solver)
    elif solver is not None:
        raise DikbenchError(f"--solver {solver}: {name} is a scenario family, which needs none")
    else:
        verdicts = verdicts_on_family(make_family(name))
    unchecked: dict[str, list[str]] = {}
    for verdict in verdicts:
        if verdict.outcome == "not checked":
            unchecked.setdefault(verdict.reason, []).append(verdict.check)
        else:
            yield verdict.outcome, verdict.check, verdict.reason
    for reason, checks in unchecked.items():
        yield "not checked", ", ".join(checks), reason
