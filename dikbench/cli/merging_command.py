"""The command that merges results folders; slow imports are inside it."""

from __future__ import annotations

import shlex
import sys
from pathlib import Path

import click

from dikbench.cli.one_line_errors import one_line_errors


@click.command()
@click.argument(
    "folders",
    metavar="A B ...",
    nargs=-1,
    required=True,
    type=click.Path(path_type=Path, file_okay=False),
)
@click.option(
    "--out",
    type=click.Path(path_type=Path, file_okay=False),
    required=True,
    metavar="DIR",
    help="Results folder of the merged rows; what is there of the same study is merged as well.",
)
@one_line_errors
def merge(folders: tuple[Path, ...], out: Path) -> None:
    """Merge results folders of one study, such as those of its shards, in another one.

    They must be of the same engine, sources and versions. Rows of one trial that contradict each
    other are named, and nothing is merged then. The merged folder is like any other: `report`,
    `compare` and `status` read it, and the command of the study, without --shard, runs what is
    missing and takes the times.
    """
    from dikbench.run.merge import merge_results

    found = merge_results(folders, out, shlex.join(["dikbench", *sys.argv[1:]]))
    click.echo(f"{found}; {out / 'trials.csv'}")
