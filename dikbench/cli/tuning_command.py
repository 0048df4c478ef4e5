"""The command that tunes formulations. Heavy imports stand inside the command."""

from __future__ import annotations

import shlex
import signal
import sys
from pathlib import Path

import click

from dikbench.cli.one_line_errors import one_line_errors


@click.command()
@click.argument("formulations", metavar="[FORMULATION]...", nargs=-1)
@click.option(
    "--study",
    default="train",
    show_default=True,
    metavar="STUDY",
    help="The study on which they are tuned; it must be of the train split.",
)
@click.option(
    "--budget",
    type=click.IntRange(2, 4096),
    default=32,
    show_default=True,
    metavar="N",
    help="Points that are tried for each formulation, in addition to its default; a power of 2 "
    "covers the ranges most evenly.",
)
@click.option(
    "--seed", type=click.IntRange(min=0), default=0, show_default=True, help="Seed of the points."
)
@click.option(
    "--out",
    type=click.Path(path_type=Path, file_okay=False),
    default=Path("runs/tune"),
    show_default=True,
    metavar="DIR",
    help="Results folder; what is finished there is kept.",
)
@click.option(
    "--jobs",
    type=click.IntRange(min=1),
    metavar="N",
    help="Worker processes; default: one per core.",
)
@click.option(
    "--rerun",
    type=click.Choice(["failed", "outdated", "all"]),
    metavar="WHICH",
    help="Run finished trials again: failed (such as those that a busy machine stopped at their "
    "time limit), outdated (made by other sources or versions) or all.",
)
@click.option(
    "--freeze",
    is_flag=True,
    help="Write what is found to tuned.toml beside the formulations' files, so that 'dls[tuned]' "
    "selects it.",
)
@one_line_errors
def tune(
    formulations: tuple[str, ...],
    study: str,
    budget: int,
    seed: int,
    out: Path,
    jobs: int | None,
    rerun: str | None,
    freeze: bool,
) -> None:
    """Tune formulations on the train split with equal budgets, and report them on the test split.

    FORMULATION is a selector; its parameters in brackets stay as they are. Default: all that have
    a parameter to tune. For each, points of a scrambled Sobol sequence are tried over the ranges
    that its class declares, and the best has the largest mean success over 1, 2, 5, 10 and 20 mm,
    both references and the families of the study, then the smallest distance from the path. The
    same command continues a run that was stopped.
    """
    from dikbench.plugins.building import in_declared_order, make_formulation
    from dikbench.run.in_workers import RunSettings
    from dikbench.run.pool import available_cores
    from dikbench.run.runner import Interrupted
    from dikbench.tuning import tuning
    from dikbench.tuning.candidates import tunable
    from dikbench.tuning.drawing import draw_sensitivity
    from dikbench.tuning.tables import gain_in_words, in_words, write_tables

    asked = [in_declared_order("formulation", text) for text in formulations] or tunable()
    # Two names of the same formulation are one.
    chosen = list({(each.name, repr(make_formulation(each))): each for each in asked}.values())
    command = shlex.join(["dikbench", *sys.argv[1:]])
    settings = RunSettings(jobs or available_cores(), traces="none", rerun=rerun or "")
    signal.signal(signal.SIGTERM, signal.default_int_handler)  # a stop like Ctrl-C
    found = []
    try:
        for each in tuning.tune(
            chosen, tuning.train_study(study), budget, seed, out, settings, command
        ):
            found.append(each)
            click.echo(in_words(each))
            write_tables(found, out)
        found = tuning.report_on_test(found, out, settings, command)
    except Interrupted as stopped:
        click.echo(f"\nstopped: {stopped}; to continue: {command}", err=True)
        sys.exit(130)
    write_tables(found, out)
    for each in found:
        click.echo(gain_in_words(each))
    for file in tuning.freeze(found) if freeze else ():
        click.echo(str(file))
    click.echo(f"\n{out / 'tuning.csv'}\n{draw_sensitivity(found, out)}")
