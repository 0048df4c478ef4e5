"""The command that runs published experiments again. Heavy imports stand inside the command."""

from __future__ import annotations

from pathlib import Path

import click

from dikbench.cli.one_line_errors import one_line_errors


@click.command()
@click.argument("names", metavar="[NAME]...", nargs=-1)
@click.option(
    "--out",
    type=click.Path(path_type=Path, dir_okay=False),
    metavar="FILE",
    help="Write the tables to a Markdown file as well.",
)
@click.option(
    "--jobs",
    type=click.IntRange(min=1),
    metavar="N",
    help="Worker processes; default: one per core.",
)
@one_line_errors
def reproduce(names: tuple[str, ...], out: Path | None, jobs: int | None) -> None:
    """Run published experiments again with the formulations here, published beside measured.

    NAME is one of `dikbench list published`; default: all of them, in minutes. Every row has a
    verdict: equal, inside noise, not reproduced, or not covered and why. Targets and starts are
    drawn with the seeds of the sources.
    """
    from dikbench.errors import DikbenchError
    from dikbench.published.reproducing import (
        EXPLANATION,
        as_markdown,
        reproduce,
        summary,
        whole_page,
    )
    from dikbench.run.pool import available_cores

    if out is not None and not out.parent.is_dir():
        raise DikbenchError(f"--out {out}: no such folder: {out.parent}; valid: one that exists")
    found = reproduce(names, jobs or available_cores())
    for name, rows in found.items():
        click.echo(as_markdown(name, rows) + "\n")
    click.echo(f"{EXPLANATION}\n\n{summary(found)}")
    if out is not None:
        out.write_text(whole_page(found), encoding="utf-8")
        click.echo(f"\n{out}")
