"""The command line: `dikbench run`, `list`, `show`. Heavy imports stand inside the commands."""

from __future__ import annotations

import functools
import shlex
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import click

from dikbench.errors import DikbenchError

SUBJECTS = ("formulations", "scenarios", "solvers", "robots", "metrics", "studies")


def one_line_errors(command: Callable[..., None]) -> Callable[..., None]:
    """Turn an error that a user caused into one line on stderr and exit code 2."""

    @functools.wraps(command)
    def wrapped(*args: Any, **kwargs: Any) -> None:
        try:
            command(*args, **kwargs)
        except DikbenchError as error:
            click.echo("error: " + " ".join(str(error).split()), err=True)
            sys.exit(2)

    return wrapped


def main() -> None:
    """Run the command line; a wrong option is one line as well."""
    try:
        sys.exit(commands.main(standalone_mode=False))
    except click.exceptions.NoArgsIsHelpError as error:
        click.echo(error.format_message())
        sys.exit(2)
    except click.ClickException as error:
        click.echo("error: " + " ".join(error.format_message().split()), err=True)
        sys.exit(2)
    except click.Abort:
        click.echo("interrupted: nothing was written", err=True)
        sys.exit(130)


@click.group(context_settings={"help_option_names": ["-h", "--help"], "max_content_width": 100})
@click.version_option(package_name="dikbench")
def commands() -> None:
    """Compare laws of differential inverse kinematics in closed loop, on real robot models.

    A selector is a name, with parameters where wanted: 'dls[damping=0.1]',
    'near-miss[robot=ur5,miss=0.02]', 'osqp[eps_abs=1e-6]'.
    """


@commands.command()
@click.argument("study", required=False)
@click.option(
    "--formulation",
    "formulations",
    multiple=True,
    metavar="SELECTOR",
    help="A law, or path/to/file.py:Class; repeat for more.",
)
@click.option(
    "--scenario",
    "scenarios",
    multiple=True,
    metavar="SELECTOR",
    help="A scenario; repeat for more.",
)
@click.option(
    "--solver",
    "solvers",
    multiple=True,
    metavar="SELECTOR",
    help="A solver, for laws that need one; repeat for more.",
)
@click.option(
    "--seed",
    "seeds",
    multiple=True,
    type=click.IntRange(min=0),
    metavar="N",
    help="A seed of the scenarios; 0 perturbs nothing; repeat for more.",
)
@click.option(
    "--plant",
    "plants",
    multiple=True,
    type=click.Choice(["ideal", "saturating"]),
    help="What becomes of a command; repeat for both.",
)
@click.option(
    "--reference",
    "references",
    multiple=True,
    type=click.Choice(["time", "path"]),
    help="What moves the reference on: the clock, or the progress achieved.",
)
@click.option(
    "--jobs",
    type=click.IntRange(min=1),
    metavar="N",
    help="Worker processes; default: one per core.",
)
@click.option(
    "--out",
    type=click.Path(path_type=Path, file_okay=False),
    metavar="DIR",
    help="Results folder; default: runs/STUDY.",
)
@one_line_errors
def run(
    study: str | None,
    formulations: tuple[str, ...],
    scenarios: tuple[str, ...],
    solvers: tuple[str, ...],
    seeds: tuple[int, ...],
    plants: tuple[str, ...],
    references: tuple[str, ...],
    jobs: int | None,
    out: Path | None,
) -> None:  # fmt: skip
    """Run a study: the matrix of laws x scenarios x solvers.

    STUDY is a shipped study (see `dikbench list studies`) or a TOML file; default: quick. Each
    option replaces an axis of the study.
    """
    from dikbench.report.page import write_report
    from dikbench.run.runner import run_study
    from dikbench.run.workers import available_cores
    from dikbench.study import DEFAULT_STUDY, Selection, load_study, select

    selection = Selection(formulations, scenarios, solvers, seeds, plants, references)
    selected = select(load_study(study or DEFAULT_STUDY), selection, named=study is not None)
    folder = out or Path("runs") / selected.name
    command = shlex.join(["dikbench", *sys.argv[1:]])
    run_study(selected, folder, jobs or available_cores(), command)
    click.echo(f"\n{write_report(folder)}\n\n{folder / 'report.md'}")


@commands.command("list")
@click.argument("subject", required=False, type=click.Choice(SUBJECTS))
@one_line_errors
def list_(subject: str | None) -> None:
    """List what there is, a line each with its source; all of it without SUBJECT."""
    from dikbench.listing import listing

    for name in (subject,) if subject else SUBJECTS:
        if subject is None:
            click.echo(f"{name}:")
        for line in listing(name):
            click.echo(f"  {line}" if subject is None else line)


@commands.command()
@click.argument("name")
@one_line_errors
def show(name: str) -> None:
    """Print one law, scenario, solver, robot, metric or study in full.

    A scenario's selector prints its certificate as well.
    """
    from dikbench.listing import description

    click.echo(description(name))
