"""Advice as a page: one file, no network."""

from __future__ import annotations

import base64
from collections.abc import Sequence
from importlib import resources
from pathlib import Path

from jinja2 import Environment, StrictUndefined
from markupsafe import Markup

from dikbench.advice.answering import Answer, Standing
from dikbench.errors import DikbenchError
from dikbench.report.drawing.figure import Figure
from dikbench.report.pages.backticks import to_html


def write_page(
    file: Path,
    title: str,
    chapters: Sequence[tuple[str, list[str]]],
    answers: Sequence[Answer],
    of_arm: Sequence[Figure],
    phases: Sequence[Figure],
    folder: Path,
    program: str,
) -> None:
    """Write the page.

    Args:
        file: where it is written.
        title: its heading.
        chapters: headings with their lines.
        answers: to each need, for tables.
        of_arm: figures of the arm and its path.
        phases: phase diagrams.
        folder: of the figures.
        program: a program; empty for none.

    Raises:
        DikbenchError: if it cannot be written.
    """
    environment = Environment(autoescape=True, undefined=StrictUndefined)
    environment.filters["backticks"] = to_html
    template = resources.files("dikbench.advice") / "templates" / "advice.html.j2"
    text = environment.from_string(template.read_text(encoding="utf-8")).render(
        title=title,
        chapters=chapters,
        answers=answers,
        rows=_rows,
        of_arm=[_image(each, folder) for each in of_arm],
        phases=[_image(each, folder) for each in phases],
        program=program,
    )
    try:
        file.parent.mkdir(parents=True, exist_ok=True)
        file.write_text(text, encoding="utf-8")
    except OSError as error:
        raise DikbenchError(f"page {file}: {error.strerror or error}") from None


def _rows(answer: Answer) -> list[tuple[Standing, bool]]:
    """List all formulations, those first that are recommended or tied with it."""
    first = () if answer.first is None else (answer.first,)
    equal = [(each, True) for each in (*first, *answer.tied, *answer.left_behind)]
    return equal + [(each, False) for each in answer.others]


def _image(figure: Figure, folder: Path) -> Markup:
    """Write a figure into the page."""
    data = base64.b64encode((folder / figure.file).read_bytes()).decode()
    return Markup(
        '<figure><img alt="{title}" src="data:image/svg+xml;base64,{data}">'
        "<figcaption>{caption}</figcaption></figure>"
    ).format(title=figure.title, data=data, caption=figure.caption)
