"""Commands that read results; slow imports are inside the commands."""

from __future__ import annotations

import re
import sys
from pathlib import Path
from typing import Any

import click

from dikbench.cli.one_line_errors import one_line_errors
from dikbench.errors import DikbenchError

MOST_FORMULATIONS = 2
"""One is compared with all others, two with one another."""

MOST_REPLAYED = 2


@click.command()
@click.argument("a", metavar="A", type=click.Path(path_type=Path, file_okay=False))
@click.argument(
    "b", metavar="[B]", required=False, type=click.Path(path_type=Path, file_okay=False)
)
@click.option(
    "--tolerance",
    "tolerances",
    multiple=True,
    metavar="METRIC=VALUE",
    help="How much worse a metric may become in any trial, in its unit or in percent of its value "
    "in A ('position_error_rms_m=5%'); how much the rate of success of a formulation may fall "
    "('success=2%', else 0); how much longer it may take ('formulation_time_median_us=20%'); "
    "repeat. Trials that are missing or newly fail exceed it as well, and those whose solver does.",
)
@click.option(
    "--formulation",
    "formulations",
    multiple=True,
    metavar="NAME",
    help="Compare formulations within A: this one with a second one, or with all others; "
    "'qp with daqp' where it ran with several solvers.",
)
@click.option(
    "--format",
    "form",
    type=click.Choice(["text", "markdown", "csv", "latex"]),
    help="How a comparison of formulations is written; default: text.",
)
@click.option(
    "--out",
    type=click.Path(path_type=Path, dir_okay=False),
    metavar="FILE",
    help="Write every row: the text (.md), or each difference of each trial (.csv); of "
    "formulations what is printed.",
)
@one_line_errors
def compare(
    a: Path,
    b: Path | None,
    tolerances: tuple[str, ...],
    formulations: tuple[str, ...],
    form: str | None,
    out: Path | None,
) -> None:
    """Compare two results folders, B with A, or formulations within one.

    The first line says whether B passes. The exit code is 1 where a tolerance is exceeded, 2 where
    there is nothing to compare.
    """
    if formulations:
        if b is not None or tolerances or len(formulations) > MOST_FORMULATIONS:
            raise DikbenchError(
                "--formulation compares one or two formulations within one results folder, "
                "without --tolerance"
            )
        _compare_formulations(a, formulations, form or "text", out)
        return
    if b is None or form is not None:
        raise DikbenchError(
            "compare takes two results folders, or one and --formulation (which --format is for)"
        )
    from dikbench.report.comparison.comparison import compare as compare_folders
    from dikbench.report.comparison.rendering import render, write
    from dikbench.report.comparison.tolerances import parse_tolerance
    from dikbench.results.reading import metrics_in

    others = {**metrics_in(a), **metrics_in(b)}
    found = compare_folders(a, b, [parse_tolerance(text, others) for text in tolerances])
    if out is not None:
        write(found, out)
    click.echo(render(found))
    sys.exit(1 if found.regressed else 0)


def _compare_formulations(
    folder: Path, formulations: tuple[str, ...], form: str, out: Path | None
) -> None:
    """Print how a formulation does against others, and write it to a file."""
    from dikbench.report.comparison.formulation_tables import FORMATS
    from dikbench.report.comparison.formulations import compare_formulations
    from dikbench.report.selection.judged import judged_plant
    from dikbench.results.reading import read_results, without_attributes

    trials = without_attributes(read_results(folder)).trials
    text = FORMATS[form](compare_formulations(trials, formulations), judged_plant(trials))
    if out is not None:
        try:
            out.write_text(text + "\n", encoding="utf-8")
        except OSError as error:
            raise DikbenchError(f"file {out}: {error.strerror or error}") from None
    click.echo(text)


def _listed(_context: click.Context, _option: click.Parameter, value: str) -> list[str]:
    """Split a text at commas that stand outside of brackets."""
    return [part.strip() for part in re.split(r",(?![^\[]*\])", value) if part.strip()]


@click.command()
@click.argument("folder", metavar="RESULTS", type=click.Path(path_type=Path, file_okay=False))
@click.option(
    "--table",
    "name",
    default="success",
    show_default=True,
    metavar="NAME",
    help="success, outcomes, tracking_error, limit_violation, timing or solvers.",
)
@click.option(
    "--columns",
    default="",
    callback=_listed,
    metavar="KEY,...",
    help="Columns by their names in CSV, in this order; default: those that fit.",
)
@click.option(
    "--formulations",
    default="",
    callback=_listed,
    metavar="SELECTOR,...",
    help="Formulations in this order; default: all.",
)
@click.option(
    "--names",
    type=click.Path(path_type=Path, dir_okay=False),
    metavar="FILE",
    help="TOML with display names: tables [formulations], [solvers] and [columns].",
)
@click.option(
    "--format",
    "form",
    type=click.Choice(["latex", "markdown", "csv"]),
    default="latex",
    show_default=True,
    help="LaTeX fits a column of a two-column paper (booktabs, graphicx, xcolor).",
)
@one_line_errors
def table(
    folder: Path,
    name: str,
    columns: list[str],
    formulations: list[str],
    names: Path | None,
    form: Any,
) -> None:
    """Print a table of a results folder for a paper: chosen columns and formulations, own names."""
    from dikbench.report.tables.chosen import chosen_table, read_display_names, written

    display = None if names is None else read_display_names(names)
    click.echo(written(chosen_table(folder, name, columns, formulations, display), form), nl=False)


@click.command()
@click.argument("trials", metavar="TRIAL [TRIAL]", nargs=-1, required=True)
@click.option(
    "--results",
    type=click.Path(path_type=Path, file_okay=False),
    metavar="DIR",
    help="Results folder; default: the one of the trace, or the newest of runs/*.",
)
@click.option(
    "--speed",
    type=click.FloatRange(min=0, min_open=True),
    default=1.0,
    show_default=True,
    help="Speed of the replay over the robot's.",
)
@click.option(
    "--html",
    type=click.Path(path_type=Path, dir_okay=False),
    metavar="FILE",
    help="Write the replay to one HTML file instead of serving it.",
)
@one_line_errors
def replay(trials: tuple[str, ...], results: Path | None, speed: float, html: Path | None) -> None:
    """Show a trial in the browser, or two side by side: robot, target, path, limits, obstacles.

    TRIAL is the trial's id in trials.csv, the beginning of it, or the file of its trace.
    """
    if len(trials) > MOST_REPLAYED:
        raise DikbenchError(f"replay takes one trial, or two side by side; got {len(trials)}")
    if not speed < float("inf"):
        raise DikbenchError(f"--speed: expected a positive number, got {speed}")
    from dikbench.viewer.legend import captions, legend
    from dikbench.viewer.recording import find_recording
    from dikbench.viewer.replay import serve_replay, write_replay

    recordings = [find_recording(trial, results) for trial in trials]
    told = [line for recording in recordings for line in captions(recording, speed)]
    click.echo("\n".join([*told, *(text for _, text in legend(recordings))]))
    if html is None:
        serve_replay(recordings, speed)
    else:
        write_replay(recordings, speed, html)
        click.echo(html)
