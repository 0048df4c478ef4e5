"""Commands that read results; slow imports are inside the commands."""

from __future__ import annotations

import sys
from pathlib import Path

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
    "in A ('position_error_rms_m=5%'); how much the rate of success of a formulation may fall "
    "('success=2%', else 0); how much longer it may take ('formulation_time_median_us=20%'); "
    "repeat. Trials that are missing or newly fail exceed it as well, and those whose solver does.",
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
