"""The command that gives advice for an arm."""

from __future__ import annotations

import re
import shlex
import signal
import sys
from pathlib import Path

import click

from dikbench.cli.one_line_errors import one_line_errors
from dikbench.cli.study_options import JOBS_OPTION

UNITS = {"": 1.0, "s": 1.0, "min": 60.0, "h": 3600.0}
SHORTEST_S = 20.0


def seconds(context: click.Context, option: click.Parameter, text: str) -> float:
    """Read a time such as 3min, 90s or 90."""
    match = re.fullmatch(r"([0-9.]+) ?(s|min|h|)", text.strip())
    try:
        value = float(match[1]) * UNITS[match[2]] if match else 0.0
    except ValueError:
        value = 0.0
    if value < SHORTEST_S:
        raise click.BadParameter(f"{text!r}; valid: such as 3min or 90s, at least {SHORTEST_S:g} s")
    return value


@click.command()
@click.argument("robot")
@click.option("--frame", metavar="FRAME", help="Task frame; default: the robot's own, of a URDF "
              "the last link that most joints move.")  # fmt: skip
@click.option(
    "--path",
    type=click.Path(path_type=Path, dir_okay=False),
    metavar="FILE",
    help="Poses that it is to follow: a CSV file with t, x, y, z, qx, qy, qz, qw.",
)
@click.option(
    "--obstacles",
    type=click.Path(path_type=Path, dir_okay=False),
    metavar="FILE",
    help="Obstacles about the path, a TOML file.",
)
@click.option(
    "--dt",
    type=click.FloatRange(min=1e-4, max=0.1),
    default=0.01,
    show_default=True,
    metavar="SECONDS",
    help="Control period.",
)
@click.option(
    "--acceleration",
    metavar="NUMBERS",
    help="Acceleration limits [rad/s^2 or m/s^2], one for all joints or one for each; default: "
    "none are in force.",
)
@click.option(
    "--need",
    "needs",
    multiple=True,
    metavar="NEED",
    help="What it is to do: on-path=1mm (the path may wait), on-time=5mm (the clock does not), "
    "limits; repeat for more; default: all three, at 5 mm.",
)
@click.option(
    "--budget", callback=seconds, default="3min", show_default=True, metavar="TIME",
    help="How long it may take.",
)  # fmt: skip
@click.option(
    "--seed", type=click.IntRange(min=0), default=0, show_default=True, help="Seed of the cases."
)
@click.option(
    "--formulation",
    "formulations",
    multiple=True,
    metavar="SELECTOR",
    help="A formulation that is tried in addition; repeat for more.",
)
@click.option(
    "--html",
    type=click.Path(path_type=Path, dir_okay=False),
    metavar="FILE",
    help="The page; default: advice.html in the results folder.",
)
@click.option(
    "--out",
    type=click.Path(path_type=Path, file_okay=False),
    metavar="DIR",
    help="Results folder; default: runs/advice-ROBOT.",
)
@JOBS_OPTION
@one_line_errors
def advise(
    robot: str,
    frame: str | None,
    path: Path | None,
    obstacles: Path | None,
    dt: float,
    acceleration: str | None,
    needs: tuple[str, ...],
    budget: float,
    seed: int,
    formulations: tuple[str, ...],
    html: Path | None,
    out: Path | None,
    jobs: int | None,
) -> None:
    """Say which formulation suits an arm: which law, which parameters, and what it will not do.

    ROBOT is a name of `dikbench list robots`, or a URDF. Formulations are tried on cases that are
    made for this arm, near its own singularities and limits and beyond its speed, and on the given
    path; what the sample does not tell apart is said to be tied.
    """
    from dikbench.advice.advising import advise as advise_on
    from dikbench.advice.arm import look_at
    from dikbench.advice.cases import cases_for
    from dikbench.advice.needs import DEFAULTS, parsed_need
    from dikbench.advice.presenting import present
    from dikbench.advice.trying import Clock, candidates
    from dikbench.run.in_workers import RunSettings
    from dikbench.run.pool import available_cores
    from dikbench.run.progress_display import BudgetDisplay

    clock = Clock(budget)
    asked = [parsed_need(text) for text in needs or DEFAULTS]
    contenders = candidates(formulations)
    arm = look_at(robot, frame, acceleration)
    folder = out or Path("runs") / f"advice-{arm.robot.name}"
    cases = cases_for(arm, dt, seed, path, obstacles, folder)
    settings = RunSettings(jobs or available_cores())
    signal.signal(signal.SIGTERM, signal.default_int_handler)  # a stop like Ctrl-C
    again = shlex.join(["dikbench", *sys.argv[1:]])

    with BudgetDisplay(f"{budget:g} s") as display:

        def say(what: str) -> None:
            display.tell(clock.spent, what)

        found = advise_on(arm, dt, cases, contenders, asked, clock, seed, settings, say)
    page = html or folder / "advice.html"
    chapters, program = present(found, folder, page, settings, again)
    for heading, lines in chapters:
        click.echo(f"{heading}\n" + "".join(f"  - {line}\n" for line in lines))
    if program:
        click.echo(f"In a control loop\n\n{program}")
    click.echo(f"{page} ({clock.spent * budget:.0f} s)")
