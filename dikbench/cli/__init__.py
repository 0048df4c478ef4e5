"""The command line; slow imports are inside the commands."""

from __future__ import annotations

import shlex
import signal
import sys
from pathlib import Path
from typing import Any

import click

from dikbench.cli.advice_command import advise
from dikbench.cli.checking import check
from dikbench.cli.merging_command import merge
from dikbench.cli.new_command import new
from dikbench.cli.one_line_errors import one_line_errors
from dikbench.cli.reading_commands import compare, replay, table
from dikbench.cli.reproducing_command import reproduce
from dikbench.cli.study_options import JOBS_OPTION, METRIC_OPTION, study_options
from dikbench.cli.tuning_command import tune
from dikbench.cli.worst_command import worst

EXIT_CODE_OF_STANDSTILL = 3
"""Exit code of a run in which no trial of a formulation took a step."""

SUBJECTS = (
    "formulations", "scenarios", "solvers", "plants", "robots", "metrics", "outcomes", "studies",
    "published",
)  # fmt: skip


def main() -> None:
    """Run the command line; a wrong option gives one line."""
    try:
        sys.exit(commands.main(prog_name="dikbench", standalone_mode=False))
    except click.exceptions.NoArgsIsHelpError as error:
        click.echo(error.format_message())
        sys.exit(2)
    except click.ClickException as error:
        click.echo("error: " + " ".join(error.format_message().split()), err=True)
        sys.exit(2)
    except click.Abort:
        click.echo("interrupted", err=True)
        sys.exit(130)
    except ValueError as error:
        if "null byte" not in str(error):
            raise
        click.echo("error: a path holds a null byte; valid: any other characters", err=True)
        sys.exit(2)


@click.group(context_settings={"help_option_names": ["-h", "--help"], "max_content_width": 100})
@click.version_option(package_name="dikbench")
def commands() -> None:
    """Compare formulations of differential inverse kinematics in closed loop, on real robot models.

    A selector is a name, with parameters if needed: 'dls[damping=0.1]',
    'near-miss[robot=ur5,miss=0.02]', 'osqp[eps_abs=1e-6]'.
    """


def _selected(study: str | None, axes: dict[str, Any], out: Path | None) -> tuple[Any, Path]:
    """Return the study that the options select, and its results folder."""
    from dikbench.cli.running import results_folder, selected
    from dikbench.study.selection import Selection

    chosen = selected(study, Selection(**axes))
    return chosen, results_folder(chosen, out)


@commands.command()
@study_options
@click.option(
    "--instances",
    type=click.IntRange(min=0),
    default=0,
    metavar="N",
    help="Draw N random instances of each scenario, in place of seeds; what its selector gives is "
    "fixed.",
)
@click.option(
    "--fraction",
    type=click.FloatRange(min=0, max=1, min_open=True),
    default=1.0,
    metavar="SHARE",
    help="Run the first SHARE of the instances; a larger one continues the run.",
)
@JOBS_OPTION
@click.option(
    "--rerun",
    default="",
    metavar="WHICH",
    help="Run finished trials again: failed, outdated (made by other sources or versions), all, or "
    "a formulation, scenario or solver.",
)
@click.option(
    "--trial-timeout",
    type=click.FloatRange(min=0, min_open=True),
    default=120.0,
    show_default=True,
    metavar="SECONDS",
    help="Wall-clock limit of a trial.",
)
@click.option(
    "--trial-memory",
    type=click.IntRange(min=1),
    default=4096,
    show_default=True,
    metavar="MB",
    help="Memory of a trial.",
)
@click.option(
    "--traces",
    type=click.Choice(["all", "failures", "none"]),
    default="all",
    show_default=True,
    help="Which trials keep their control steps.",
)
@click.option(
    "--engine",
    type=click.Choice(["auto", "alone", "lockstep"]),
    default="auto",
    show_default=True,
    help="Whether trials of one kind run in lockstep, many at a time, or each alone; auto: in "
    "lockstep where there are many of a kind. The results are the same but for rounding.",
)
@click.option(
    "--executor",
    type=click.Choice(["local", "dask"]),
    default="local",
    show_default=True,
    help="Where trials run: in processes of this machine, or on a cluster of dask.",
)
@click.option(
    "--scheduler",
    default="",
    metavar="ADDRESS",
    help="The scheduler of the cluster, such as tcp://host:8786, or its file (.json).",
)
@click.option(
    "--shard",
    default="1/1",
    metavar="NUMBER/PARTS",
    help="Run one of so many equal parts of the study, which `dikbench merge` puts together.",
)
@one_line_errors
def run(
    study: str | None,
    out: Path | None,
    jobs: int | None,
    rerun: str,
    trial_timeout: float,
    trial_memory: int,
    traces: Any,
    engine: Any,
    executor: str,
    scheduler: str,
    shard: str,
    **axes: Any,
) -> None:
    """Run what is missing of a study: the matrix of formulations x scenarios x solvers.

    STUDY is a shipped study (see `dikbench list studies`) or a TOML file; default: quick. Each
    option replaces an axis of the study. The same command continues a run that was stopped.

    The exit code is 0 also where trials failed, which the report counts; 3 where no trial of a
    formulation took a step, 2 where nothing could be run, 130 where the run was stopped. A shard
    has no report, and takes no times.
    """
    from dikbench.report.write import write_report
    from dikbench.run.dask_client import scheduler_given
    from dikbench.run.in_workers import RunSettings
    from dikbench.run.pool import available_cores
    from dikbench.run.runner import Interrupted, never_moved, run_study
    from dikbench.run.shards import WHOLE, parse_shard

    part, scheduler = parse_shard(shard), scheduler_given(executor, scheduler)
    selected, folder = _selected(study, axes, out)
    command = shlex.join(["dikbench", *sys.argv[1:]])
    signal.signal(signal.SIGTERM, signal.default_int_handler)  # a stop like Ctrl-C
    settings = RunSettings(
        jobs or available_cores(),
        trial_timeout,
        trial_memory,
        traces,
        rerun,
        engine,
        shard=part,
        scheduler=scheduler,
    )
    try:
        run_study(selected, folder, settings, command)
    except Interrupted as stopped:
        click.echo(f"\nstopped: {stopped}; to continue: {command}", err=True)
        sys.exit(130)
    if part != WHOLE:
        click.echo(f"shard {part} is done; {folder / 'trials.csv'}")
        return
    click.echo(f"\n{write_report(folder)}\n\n{folder / 'report.html'}")
    standstill = never_moved(folder)
    for name, reason in standstill.items():
        click.echo(f"no trial of {name} took a step: {reason}", err=True)
    if standstill:
        sys.exit(EXIT_CODE_OF_STANDSTILL)


@commands.command()
@study_options
@one_line_errors
def time(study: str | None, out: Path | None, **axes: Any) -> None:
    """Repeat the timing pass of a study, without its trials; run nothing else meanwhile.

    STUDY and the options are those of `dikbench run`.
    """
    from dikbench.report.write import write_times
    from dikbench.run.runner import Interrupted, time_study

    selected, folder = _selected(study, axes, out)
    command = shlex.join(["dikbench", *sys.argv[1:]])
    try:
        time_study(selected, folder, command)
    except Interrupted as stopped:
        click.echo(f"\nstopped: {stopped}", err=True)
        sys.exit(130)
    click.echo(f"\n{write_times(folder)}\n\n{folder / 'timing.csv'}")


@commands.command()
@click.argument("folder", metavar="DIR", type=click.Path(path_type=Path, file_okay=False))
@one_line_errors
def report(folder: Path) -> None:
    """Write the tables, figures and report of a results folder again, from its contents.

    A committed folder with trials.csv and manifest.json but without the store is enough.
    """
    from dikbench.report.write import write_report

    click.echo(f"\n{write_report(folder)}\n\n{folder / 'report.html'}")


@commands.command()
@click.argument("folder", type=click.Path(path_type=Path, file_okay=False))
@METRIC_OPTION
@JOBS_OPTION
@one_line_errors
def recompute(folder: Path, metrics: tuple[str, ...], jobs: int | None) -> None:
    """Compute all metrics of a results folder again from its traces, without running a formulation.

    For metrics that are new or have changed since the run. Trials without a trace keep their
    values; `dikbench report` writes the tables and figures again.
    """
    from dikbench.run.pool import available_cores
    from dikbench.run.recompute import recompute_results
    from dikbench.run.runner import Interrupted

    command = shlex.join(["dikbench", *sys.argv[1:]])
    try:
        done = recompute_results(folder, jobs or available_cores(), command, metrics)
    except Interrupted as stopped:
        click.echo(f"\nstopped: {stopped}; to continue: {command}", err=True)
        sys.exit(130)
    click.echo(f"{done}; {folder / 'trials.csv'}")


@commands.command()
@click.argument("folder", type=click.Path(path_type=Path, file_okay=False))
@one_line_errors
def status(folder: Path) -> None:
    """Count the trials of a results folder: done, failed by status, missing."""
    from dikbench.run.runner import status_of

    counts = status_of(folder)
    for name, number in counts.items():
        click.echo(f"{number:7} {name}")
    click.echo(f"{sum(counts.values()):7} planned")


@commands.command("list")
@click.argument("subject", required=False, type=click.Choice(SUBJECTS))
@one_line_errors
def list_(subject: str | None) -> None:
    """List formulations, scenarios, ..., a line each with its source; default: all subjects."""
    from dikbench.cli.listing import listing

    for name in (subject,) if subject else SUBJECTS:
        if subject is None:
            click.echo(f"{name}:")
        for line in listing(name):
            click.echo(f"  {line}" if subject is None else line)


@commands.command()
@click.argument("name")
@click.option(
    "--figure",
    type=click.Path(path_type=Path, dir_okay=False),
    metavar="FILE",
    help="Draw a scenario: its path, the robot, singular values and margins (.svg, .png, .pdf).",
)
@click.option(
    "--instance",
    type=click.IntRange(min=1),
    metavar="N",
    help="Draw instance N of a scenario and print what was drawn, and the command that runs it.",
)
@one_line_errors
def show(name: str, figure: Path | None, instance: int | None) -> None:
    """Print one formulation, scenario, solver, plant, robot, metric or study in full.

    Parameters may stand in brackets. A scenario's selector prints its certificate as well.
    """
    from dikbench.cli.describing import description, drawn_instance

    if instance is not None:
        click.echo(drawn_instance(name, instance))
        return
    text = description(name)
    if figure is not None:
        from dikbench.report.figures.scenario_drawing import draw_scenario

        draw_scenario(name, figure)
        text += f"\n\n{figure}"
    click.echo(text)


commands.add_command(advise)
commands.add_command(check)
commands.add_command(compare)
commands.add_command(merge)
commands.add_command(new)
commands.add_command(replay)
commands.add_command(reproduce)
commands.add_command(table)
commands.add_command(tune)
commands.add_command(worst)
