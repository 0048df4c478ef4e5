"""The Sphinx extension of the site: catalogues, the command line, notebooks, docstrings."""

from __future__ import annotations

import re
from collections.abc import Callable
from pathlib import Path
from typing import Any

import catalogue
from docutils import nodes
from myst_parser.parsers.sphinx_ import MystParser
from notebook import in_markdown
from sphinx.application import Sphinx
from sphinx.util.docutils import SphinxDirective

SHOWN = {
    "formulations/REFERENCES.md": "reference/references.md",
    "results/findings.md": "findings.md",
    "results/published.md": "published.md",
    "results/robots.md": "robots-tried.md",
}
"""Files outside of the site that a page of it shows."""

SECTIONS = ("Args:", "Attributes:", "Returns:", "Raises:", "Yields:")


class NotebookParser(MystParser):
    """Shows a notebook script as a page: its text, its code and what that prints."""

    supported = ("notebook",)

    def parse(self, inputstring: str, document: nodes.document) -> None:
        """Run the script and parse it as Markdown."""
        super().parse(in_markdown(inputstring), document)


def directive(write: Callable[[], str]) -> type[SphinxDirective]:
    """Make a directive that shows what a function writes in Markdown."""

    class Shown(SphinxDirective):
        def run(self) -> list[nodes.Node]:
            return self.parse_text_to_nodes(write(), allow_section_headings=True)

    return Shown


def literal(app: Sphinx, what: str, name: str, obj: Any, options: Any, lines: list[str]) -> None:
    """Prepare a docstring for reStructuredText: programs are literal, symbols mean themselves."""
    text = "\n".join(lines)
    parts = re.split(r"\n\s*\n", text)
    shown = []
    for part in parts:
        rows = part.split("\n")
        if part.startswith(SECTIONS):
            shown.append(_escaped(part))
        elif part.strip() and all(row.startswith("    ") for row in rows):
            shown.append("::\n\n" + part)
        else:
            shown.append(_escaped(part))
    lines[:] = "\n\n".join(shown).split("\n")


def _escaped(text: str) -> str:
    """Escape what reStructuredText takes for markup, outside of backquotes."""
    pieces = re.split(r"(`[^`]*`)", text)
    pieces[::2] = [re.sub(r"([*|\\])|(?<=\w)(_)(?!\w)", r"\\\1\2", piece) for piece in pieces[::2]]
    return "".join(pieces)


def outside(app: Sphinx, name: str, source: list[str]) -> None:
    """Turn links to files outside of the site into links to its pages, else into downloads."""
    folder = Path(app.srcdir, name).parent

    def link(found: re.Match[str]) -> str:
        text, target = found.groups()
        file = (folder / target).resolve()
        if file.is_relative_to(app.srcdir) or not file.is_file():
            return found[0]
        page = SHOWN.get(file.relative_to(Path(app.srcdir).parent).as_posix())
        return f"[{text}](/{page})" if page else f"{{download}}`{text} <{target}>`"

    source[0] = re.sub(r"(?<!!)\[([^\]]*)\]\((\.\./[^)#\s]+)\)", link, source[0])


def setup(app: Sphinx) -> dict[str, bool]:
    """Register the extension."""
    app.add_source_parser(NotebookParser)
    for name, write in catalogue.PAGES.items():
        app.add_directive(name, directive(write))
    app.connect("source-read", outside)
    app.connect("autodoc-process-docstring", literal, priority=400)  # before napoleon
    return {"parallel_read_safe": True}
