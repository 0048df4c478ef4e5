"""A docstring as a page shows it: paragraphs, programs, attributes, source."""

from __future__ import annotations

import inspect
import re
import textwrap
from dataclasses import dataclass
from typing import Final

_TITLED: Final = re.compile(r"(Source|Provokes|Shows in): ")
_LISTED: Final = ("Attributes:", "Args:")
_ENTRY: Final = re.compile(r"    (?P<names>\w+(, \w+)*): (?P<text>.*)")


@dataclass(frozen=True)
class Paragraph:
    """A part of a text.

    Attributes:
        text: its lines; one line where it is prose.
        program: whether it is a formula or a program, to be shown as it is set.
    """

    text: str
    program: bool


@dataclass(frozen=True)
class Docstring:
    """The parts of a docstring.

    Attributes:
        summary: its first line.
        paragraphs: what it says, without lists and titled paragraphs.
        entries: what it says of each attribute or argument, by name.
        titled: its paragraphs `Title: ...`, by title.
    """

    summary: str
    paragraphs: tuple[Paragraph, ...]
    entries: dict[str, str]
    titled: dict[str, str]


def parse_docstring(text: str) -> Docstring:
    """Take a docstring apart."""
    first, _, rest = inspect.cleandoc(text).partition("\n")
    paragraphs: list[Paragraph] = []
    entries: dict[str, str] = {}
    titled: dict[str, str] = {}
    for part in re.split(r"\n\s*\n", rest.strip("\n")):
        title = _TITLED.match(part)
        if part.startswith(_LISTED):
            entries |= _entries(part)
        elif title:
            titled[title[1]] = " ".join(part[title.end() :].split()).rstrip(".")
        elif all(line.startswith("    ") for line in part.split("\n")) and part:
            paragraphs.append(Paragraph(textwrap.dedent(part), program=True))
        elif part.strip():
            paragraphs.append(Paragraph(" ".join(part.split()), program=False))
    return Docstring(first.strip(), tuple(paragraphs), entries, titled)


def _entries(part: str) -> dict[str, str]:
    found: dict[str, str] = {}
    names: list[str] = []
    for line in part.split("\n")[1:]:
        if entry := _ENTRY.fullmatch(line):
            names = entry["names"].split(", ")
            found |= dict.fromkeys(names, entry["text"])
        else:
            found |= {name: f"{found[name]} {line.strip()}" for name in names}
    return found
