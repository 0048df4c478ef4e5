"""report.html: one file with everything in it."""

from __future__ import annotations

import base64
import hashlib
import re
from collections.abc import Sequence
from dataclasses import dataclass
from importlib import resources
from math import isnan
from pathlib import Path
from typing import Final

import jinja2
from markupsafe import Markup

from dikbench.report.contents.contents import Contents
from dikbench.report.drawing.figure import Figure
from dikbench.report.interactive.chosen_runs import RULE
from dikbench.report.interactive.controls import MARKS
from dikbench.report.interactive.embedded import Embedded
from dikbench.report.pages.backticks import to_html
from dikbench.report.tables.table import Column, TableCell, shown
from dikbench.viewer.static_scene import replay_script

PLAYED: Final = ("play", "Matrix")
"""The section that is played."""

PEERS: Final[str] = "peers"
"""The section that only runs with peers have."""

SECTIONS: Final[tuple[tuple[str, str], ...]] = (
    ("summary", "Summary"),
    ("tables", "Tables"),
    ("failures", "Failures"),
    ("return-codes", "Return codes"),
    (PEERS, "Other libraries"),
    ("figures", "Figures"),
    ("families", "Families"),
    ("formulations", "Formulations"),
    ("limitations", "Limitations"),
    ("made", "How it was made"),
)

MOST: Final = 11_000_000
"""Bytes of a page; figures that find no room in it stay files beside it."""

_VIEW: Final = re.compile(rb'viewBox="0 0 ([\d.]+) ([\d.]+)"')


@dataclass(frozen=True)
class Inlined:
    """A figure as the page carries it.

    Attributes:
        file: its file name.
        caption: what it shows.
        alt: the same for those who do not see it.
        uri: the figure itself; empty where it is too large.
        width, height: its size [CSS pixels]; 0 where it is not known.
    """

    file: str
    caption: str
    alt: str
    uri: str
    width: int = 0
    height: int = 0


@dataclass(frozen=True)
class Assets:
    """Style and script of the page."""

    style: Markup
    script: Markup


def render_html(contents: Contents, figures: Path, embedded: Embedded | None) -> str:
    """The page.

    Nothing is run but the scripts that come with dikbench: the page's own policy forbids every
    other one, and every connection. They bear a word that nobody knows who wrote what the page
    says, for it is a hash of the page.

    Args:
        contents: what it says.
        figures: the folder of the figures.
        embedded: what is played on it; None where there is nothing.
    """
    environment = jinja2.Environment(
        loader=jinja2.PackageLoader("dikbench.report.pages"),
        autoescape=True,
        undefined=jinja2.StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    environment.filters |= {
        "code": to_html,
        "td": _td,
        "figure": lambda value: shown(value) if isinstance(value, float) else value,
        "capitalize_first": lambda text: text[:1].upper() + text[1:],
    }
    template = environment.get_template("page.html.j2")
    sections = [each for each in SECTIONS if each[0] != PEERS or len(contents.peers)]
    given = {
        "contents": contents,
        "sections": sections if embedded is None else [PLAYED, *sections],
        "assets": _assets(),
        "charts": None if embedded is None else embedded.charts,
        "rule": RULE,
        "marks": MARKS,
        "page_data": Markup("" if embedded is None else embedded.data),
        "bundle": Markup("" if embedded is None else embedded.bundle),
    }
    bare = template.render(figures=[], nonce="", **given)
    room = (MOST - len(bare.encode())) * 3 // 4  # of four characters a figure has three bytes
    nonce = hashlib.sha256(bare.encode()).hexdigest()
    return template.render(figures=_inlined(contents.figures, figures, room), nonce=nonce, **given)


def _td(cell: TableCell, column: Column) -> Markup:
    """A number in its cell; it is sorted by `data-sort` where its text is more than the number."""
    if cell.text:
        return Markup('<td class="told" data-sort="-1">{}</td>').format(cell.text)
    if isnan(cell.value):
        return Markup("<td></td>")
    number = str(int(cell.value)) if column.count else shown(cell.value, column.most)
    failures = column.key.startswith("fail") and cell.value > 0
    classes = ["best"] * cell.best + ["unstable"] * cell.unstable + ["bad"] * failures
    attributes = f' class="{" ".join(classes)}"' if classes else ""
    if cell.unstable:
        attributes += ' title="these times cannot be trusted"'
    bounds = ""
    if cell.has_interval:
        bounds = f"<small>[{shown(cell.lower)}, {shown(cell.upper)}]</small>"
    if cell.has_interval or "inf" in number:
        attributes += f' data-sort="{number.replace("inf", "Infinity")}"'
    text = (number + bounds).replace("inf", "\N{INFINITY}")
    return Markup(f"<td{attributes}>{text}</td>")  # numbers and words of ours: nothing to escape


def _assets() -> Assets:
    folder = resources.files("dikbench.report.pages") / "assets"
    style = (folder / "report.css").read_text(encoding="utf-8")
    return Assets(
        Markup(style),
        Markup(f"{replay_script()}\n{(folder / 'page.js').read_text(encoding='utf-8')}"),
    )


def _inlined(figures: Sequence[Figure], folder: Path, room: int) -> list[Inlined]:
    """The figures, the smallest of them within the page as long as there is room [bytes]."""
    contents = [_bytes(folder / figure.file) for figure in figures]
    fitting: set[int] = set()
    for number in sorted(range(len(figures)), key=lambda number: len(contents[number])):
        room -= len(contents[number])
        if room >= 0:
            fitting.add(number)
    return [
        _image(figure, content if number in fitting else b"")
        for number, (figure, content) in enumerate(zip(figures, contents, strict=True))
    ]


def _bytes(file: Path) -> bytes:
    """The content of a file; none where it is not there."""
    try:
        return file.read_bytes()
    except OSError:
        return b""


def _image(figure: Figure, svg: bytes) -> Inlined:
    alt = figure.title or figure.caption
    if not svg:
        return Inlined(figure.file, figure.caption, alt, "")
    view = _VIEW.search(svg[:2000])
    width, height = (round(float(side) * 4 / 3) for side in view.groups()) if view else (0, 0)
    uri = f"data:image/svg+xml;base64,{base64.b64encode(svg).decode()}"
    return Inlined(figure.file, figure.caption, alt, uri, width, height)
