"""Commands that read results; slow imports are inside the commands."""

from __future__ import annotations

import re
import sys
from pathlib import Path
from typing import Any

import click

from dikbench.cli.one_line_errors import one_line_errors


@click.command()
@click.argument("a", type=click.Path(path_type=Path, file_okay=False))
@click.argument("b", type=click.Path(path_type=Path, file_okay=False))
@click.option(
    "--tolerance",
    "tolerances",
    multiple=True,
    metavar="METRIC=VALUE",
    help="How much worse a metric may become in any trial, in its unit or in percent of its value "
    "in A ('position_error_rms_m=5%'); repeat. A trial that newly fails exceeds it as well.",
)
@click.option(
    "--out",
    type=click.Path(path_type=Path, dir_okay=False),
    metavar="FILE",
    help="Write every row: the text (.md), or each difference of each trial (.csv).",
)
@one_line_errors
def compare(a: Path, b: Path, tolerances: tuple[str, ...], out: Path | None) -> None:
    """Compare two results folders, B with A, regressions first.

    The exit code is 1 where a tolerance is exceeded, 2 where the folders cannot be compared.
    """
    from dikbench.report.comparison.comparison import compare as compare_folders
    from dikbench.report.comparison.rendering import render, write
    from dikbench.report.comparison.tolerances import parse_tolerance

    found = compare_folders(a, b, [parse_tolerance(text) for text in tolerances])
    if out is not None:
        write(found, out)
    click.echo(render(found))
    sys.exit(1 if found.regressed else 0)


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
@click.argument("trial")
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
def replay(trial: str, results: Path | None, speed: float, html: Path | None) -> None:
    """Show a trial in the browser: the robot, its target, its path and its limits.

    TRIAL is the trial's id in trials.csv, the beginning of it, or the file of its trace.
    """
    from dikbench.viewer.legend import LEGEND, captions
    from dikbench.viewer.meshcat_replay import serve_replay, write_replay
    from dikbench.viewer.recording import find_recording

    recording = find_recording(trial, results)
    click.echo("\n".join([*captions(recording, speed), *(text for _, text in LEGEND)]))
    if html is None:
        serve_replay(recording, speed)
    else:
        write_replay(recording, speed, html)
        click.echo(html)
