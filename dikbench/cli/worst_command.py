"""The command that searches for the worst case of a formulation."""

from __future__ import annotations

import shlex
import signal
from pathlib import Path

import click

from dikbench.cli.one_line_errors import one_line_errors
from dikbench.cli.study_options import JOBS_OPTION


@click.command()
@click.option(
    "--formulation",
    required=True,
    metavar="SELECTOR",
    help="The formulation whose worst case is sought.",
)
@click.option(
    "--against",
    metavar="SELECTOR",
    help="Seek the case in which it is worst against this one instead.",
)
@click.option(
    "--scenario",
    required=True,
    metavar="FAMILY",
    help="A family; what is given in brackets stays, what its class declares as drawn is searched.",
)
@click.option(
    "--solver",
    default="",
    metavar="SELECTOR",
    help="For formulations that need one; default: their default one.",
)
@click.option("--plant", default="ideal", show_default=True, metavar="SELECTOR", help="The plant.")
@click.option(
    "--reference",
    type=click.Choice(["time", "path"]),
    default="time",
    show_default=True,
    help="What advances the reference: the clock, or the progress achieved.",
)
@click.option(
    "--budget",
    type=click.IntRange(min=8),
    default=400,
    show_default=True,
    metavar="N",
    help="Number of cases that are tried.",
)
@click.option(
    "--seed", type=click.IntRange(min=0), default=0, show_default=True, help="Seed of the search."
)
@JOBS_OPTION
@click.option(
    "--out",
    type=click.Path(path_type=Path, file_okay=False),
    metavar="DIR",
    help="Results folder of the worst case; default: that of the command that runs it.",
)
@one_line_errors
def worst(
    formulation: str,
    against: str | None,
    scenario: str,
    solver: str,
    plant: str,
    reference: str,
    budget: int,
    seed: int,
    jobs: int | None,
    out: Path | None,
) -> None:
    """Search the scenarios of a family for the one in which a formulation does worst.

    Worst is first by outcome: a broken limit, a collision or a run that broke off is worse than a
    job not done, and that is worse than any distance; then by the largest distance from the path.
    Only cases count that a known motion can do. The worst case is run again into a results folder,
    to be replayed; `search.csv` there lists what was tried.
    """
    from dikbench.advice.contender import contender
    from dikbench.advice.evaluating import in_workers
    from dikbench.advice.searched import searched
    from dikbench.advice.worst import search_worst
    from dikbench.advice.worst_case import in_words, keep_worst
    from dikbench.plugins.building import make_plant
    from dikbench.run.in_workers import RunSettings
    from dikbench.run.pool import available_cores
    from dikbench.run.progress_display import ProgressDisplay
    from dikbench.selector import parse_selector

    box = searched(parse_selector(scenario))
    named = [formulation] if against is None else [formulation, against]
    contenders = [contender(text, solver) for text in named]
    make_plant(plant)
    settings = RunSettings(jobs or available_cores())
    signal.signal(signal.SIGTERM, signal.default_int_handler)  # a stop like Ctrl-C
    click.echo(f"searched: {box}", err=True)
    with in_workers(settings) as evaluate, ProgressDisplay(budget, "cases") as display:
        found = search_worst(
            box,
            contenders,
            evaluate,
            budget=budget,
            seed=seed,
            plant=parse_selector(plant),
            reference=reference,
            progress=display.advance,
        )
    kept = keep_worst(found, solver, out, settings)
    click.echo("\n".join(in_words(found)))
    same = "the same to the bit" if kept.same else "NOT the same to the bit as in the search"
    click.echo(f"run again, {same}; to run it:\n  {shlex.join(kept.command)}")
    replay = ["dikbench", "replay", *kept.ids, "--results", str(kept.folder)]
    click.echo(f"to watch it:\n  {shlex.join(replay)}\n\n{kept.folder / 'search.csv'}")
