"""The README and the pages of the site, and the blocks of code in them."""

from __future__ import annotations

import re
import shlex
from collections.abc import Sequence
from pathlib import Path
from typing import Final, NamedTuple

import click

from dikbench.cli import commands

CHECKOUT: Final = Path(__file__).parents[2]
README: Final = CHECKOUT / "README.md"
PAGES: Final = (
    README,
    *(
        page
        for page in sorted((CHECKOUT / "docs").rglob("*.md"))
        if "_build" not in page.parts and "generated" not in page.parts
    ),
)


class Block(NamedTuple):
    """A block of code: its language, empty where it has none, and its text."""

    language: str
    text: str


def blocks_of(page: Path) -> list[Block]:
    """Read the blocks of a page."""
    found = re.findall(r"^```(.*?)\n(.*?)^```", page.read_text(encoding="utf-8"), re.M | re.S)
    return [Block(language, text) for language, text in found]


def files_of(page: Path) -> dict[str, str]:
    """Read the Python files that a page shows, whose first line is their name, by name."""
    return {
        named[1]: block.text
        for block in blocks_of(page)
        if (named := re.match(r"# (\w+\.py)\n", block.text))
    }


def commands_of(page: Path) -> list[list[str]]:
    """Read the `dikbench` commands in the blocks of a page, without their first word."""
    lines = [
        line
        for block in blocks_of(page)
        if block.language in ("", "bash")
        for line in block.text.replace("\\\n", " ").splitlines()
    ]
    return [shlex.split(line, comments=True)[1:] for line in lines if line.startswith("dikbench ")]


def mentioned_in(page: Path) -> list[list[str]]:
    """Read the commands that a page mentions in its sentences, up to where their output goes."""
    prose = re.sub(r"^```.*?^```", "", page.read_text(encoding="utf-8"), flags=re.M | re.S)
    return [
        shlex.split(" ".join(text.partition(">")[0].split()))
        for text in re.findall(r"`dikbench ([^`]+)`", prose)
    ]


def parse(arguments: Sequence[str]) -> click.Context:
    """Parse a command as `dikbench` does, without running it.

    Raises:
        click.ClickException: if there is no such command, option or choice.
    """
    name, *rest = arguments
    command = commands.get_command(click.Context(commands), name)
    if command is None:
        raise click.UsageError(f"no command {name}")
    return command.make_context(name, rest)
