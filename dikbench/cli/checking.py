"""The command that checks a plug-in's contract. Heavy imports stand inside the command."""

from __future__ import annotations

import sys
from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Final

import click

from dikbench.cli.one_line_errors import one_line_errors

if TYPE_CHECKING:
    from dikbench.testing.verdicts import Verdict

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
    """Print which promises a plug-in keeps, a line for each check.

    SELECTOR is the name of a formulation, scenario family, solver, plant, robot or metric, with
    parameters where wanted, or 'path/to/file.py:Class[...]'; without a class it is every plug-in
    of the file, and a folder with a pyproject.toml is every plug-in of that project. The exit code
    is 1 where a promise is broken.

    With --benchmark it is a study that is checked: straw laws, which stand still, creep, shake or
    ignore all limits, must win nothing in it, and a known joint motion must succeed.
    """
    if (name is None) == (benchmark is None):
        raise click.UsageError("give a SELECTOR, or --benchmark STUDY")
    if name is None:
        sys.exit(_echo(_of_study(str(benchmark), out, jobs)))
    from dikbench.cli.checked import subjects

    broken, several = 0, False
    for title, verdicts in subjects(name, solver):
        if title:
            click.echo(f"{chr(10) if several else ''}{title}:")
            several = True
        broken |= _echo(_lines(verdicts))
    sys.exit(broken)


def _echo(lines: Iterator[Line]) -> int:
    """Print a line for each check; return 1 where one is broken, else 0."""
    broken = 0
    for outcome, what, reason in lines:
        click.echo(f"{outcome:<12}  {what}{f': {reason}' if reason else ''}")
        broken |= outcome == "BROKEN"
    return broken


def _lines(verdicts: Iterator[Verdict]) -> Iterator[Line]:
    """Yield a line for each verdict, and one for all checks that a cause keeps from being made."""
    unchecked: dict[str, list[str]] = {}
    for verdict in verdicts:
        if verdict.outcome == "not checked":
            unchecked.setdefault(verdict.reason, []).append(verdict.check)
        else:
            yield verdict.outcome, verdict.check, verdict.reason
    for reason, checks in unchecked.items():
        yield "not checked", ", ".join(checks), reason


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
