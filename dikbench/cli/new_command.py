"""The command that writes a project of its own for a plug-in."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Final

import click

from dikbench.cli.one_line_errors import one_line_errors
from dikbench.errors import DikbenchError

NAME: Final = re.compile(r"[a-z][a-z0-9]*(-[a-z0-9]+)*")


@click.command()
@click.argument("kind", type=click.Choice(["formulation", "family"]))
@click.argument("name")
@click.option(
    "--out",
    type=click.Path(path_type=Path, file_okay=False),
    metavar="DIR",
    help="The folder that is made; default: NAME.",
)
@one_line_errors
def new(kind: str, name: str, out: Path | None) -> None:
    """Write a project with a formulation or a scenario family, its tests and a README.

    NAME is the plug-in's, such as my-law. `pip install -e NAME` makes it one of those that are
    listed; `dikbench check NAME` checks it as it is.
    """
    if not NAME.fullmatch(name):
        raise DikbenchError(
            f"name {name!r} is not valid; valid: small letters, digits and single hyphens, such as "
            f"my-{'law' if kind == 'formulation' else 'family'}"
        )
    _check_free(kind, name)
    folder = out or Path(name)
    if folder.exists() and any(folder.iterdir()):
        raise DikbenchError(f"folder {folder} is not empty; valid: another one with --out")
    from dikbench.cli.project_files import project_files

    for path, text in project_files(kind, name).items():
        try:
            (folder / path).parent.mkdir(parents=True, exist_ok=True)
            (folder / path).write_text(text, encoding="utf-8")
        except OSError as error:
            raise DikbenchError(f"{folder / path}: {error.strerror or error}") from None
        click.echo(folder / path)
    click.echo(f"\ndikbench check {folder}\npip install -e {folder}")


def _check_free(kind: str, name: str) -> None:
    """Check that no plug-in of dikbench, and no module that is here, has the name.

    Raises:
        DikbenchError: if one has.
    """
    import sys
    from importlib.util import find_spec

    from dikbench.plugins.finding import formulations_and_peers, plugins

    known = formulations_and_peers() if kind == "formulation" else plugins("scenario")
    if name in known:
        raise DikbenchError(
            f"a {kind} is called {name!r} already ({known[name].file}); valid: another name"
        )
    package = name.replace("-", "_")
    if package in sys.stdlib_module_names or find_spec(package) is not None:
        raise DikbenchError(f"a module {package!r} is here already; valid: another name")
