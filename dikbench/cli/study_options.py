"""The options that select a study, its axes and its results folder."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import click


def _axis(name: str, help: str, **settings: Any) -> Callable[..., Any]:
    """Make the option that replaces an axis of a study; it may be repeated."""
    return click.option(f"--{name}", f"{name}s", multiple=True, help=help, **settings)


METRIC_OPTION = _axis(
    "metric",
    "A metric of yours, path/to/file.py:NAME, beside those of dikbench; repeat for more.",
    metavar="SELECTOR",
)

STUDY_OPTIONS = (
    click.argument("study", required=False),
    _axis(
        "formulation",
        "A formulation, path/to/file.py:Class, or oracle; 'dls[damping=0.01|0.1]' is two.",
        metavar="SELECTOR",
    ),
    _axis("scenario", "A scenario, or path/to/file.py:Class; repeat for more.", metavar="SELECTOR"),
    _axis(
        "solver",
        "A solver, or path/to/file.py:Class, for formulations that need one; repeat for more.",
        metavar="SELECTOR",
    ),
    _axis(
        "seed",
        "A seed of the scenarios; 0 perturbs nothing; repeat for more.",
        type=click.IntRange(min=0),
        metavar="N",
    ),
    _axis(
        "plant",
        "A plant: ideal, protective, saturating or path/to/file.py:Class, with noise and delay: "
        "'ideal[noise=1e-4,delay=2]'.",
        metavar="SELECTOR",
    ),
    _axis(
        "reference",
        "What advances the reference: the clock, or the progress achieved.",
        type=click.Choice(["time", "path"]),
    ),
    METRIC_OPTION,
    click.option(
        "--out",
        type=click.Path(path_type=Path, file_okay=False),
        metavar="DIR",
        help="Results folder; default: runs/STUDY, without STUDY one for each selection.",
    ),
)

JOBS_OPTION = click.option(
    "--jobs",
    type=click.IntRange(min=1),
    metavar="N",
    help="Worker processes; default: one per core.",
)


def study_options(command: Callable[..., None]) -> Callable[..., None]:
    """Add the options that select a study, its axes and its results folder."""
    for option in reversed(STUDY_OPTIONS):
        command = option(command)
    return command
