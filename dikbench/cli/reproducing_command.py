"""The command that runs published experiments again. Heavy imports stand inside the command."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import Final

import click

from dikbench.cli.one_line_errors import one_line_errors

EXIT_CODE_OF_NOTHING_MEASURED: Final = 3


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
    verdict, which the last lines explain. Targets and starts are drawn with the seeds of the
    sources. The exit code is 3 where nothing could be measured.
    """
    from dikbench.errors import DikbenchError
    from dikbench.published.experiment import published_experiments
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
    found = {}
    for name, rows in reproduce(names, jobs or available_cores()):
        click.echo(as_markdown(name, rows) + "\n")
        found[name] = rows
    click.echo(f"{EXPLANATION}\n\n{summary(found)}")
    if out is not None:
        ordered = {name: found[name] for name in (names or published_experiments())}
        try:
            out.write_text(whole_page(ordered), encoding="utf-8")
        except OSError as error:
            raise DikbenchError(f"--out {out}: {error.strerror or error}") from None
        click.echo(f"\n{out}")
    if all(each.measured is None for rows in found.values() for each in rows):
        sys.exit(EXIT_CODE_OF_NOTHING_MEASURED)
