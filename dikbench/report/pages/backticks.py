"""Sentences with names between backticks, for pages of either kind."""

from __future__ import annotations

from markupsafe import Markup, escape

from dikbench.report.tables import markdown


def _parts(text: str) -> tuple[list[str], list[str]]:
    """What stands outside and inside of backticks, in turn; a single backtick is text."""
    pieces = text.split("`")
    if len(pieces) % 2 == 0:
        pieces[-2:] = ["`".join(pieces[-2:])]
    return pieces[::2], pieces[1::2]


def to_html(text: str) -> Markup:
    """The sentence as HTML, names as code."""
    outside, inside = _parts(text)
    html = escape(outside[0])
    for name, after in zip(inside, outside[1:], strict=True):
        html += Markup("<code>{}</code>{}").format(name, after)
    return html


def to_markdown(text: str) -> str:
    """The sentence as Markdown, names as code."""
    outside, inside = _parts(text)
    parts = [_escaped(outside[0])]
    for name, after in zip(inside, outside[1:], strict=True):
        parts += [f"`{' '.join(name.split())}`", _escaped(after)]
    return "".join(parts)


def _escaped(text: str) -> str:
    """Escaped, with the blanks at its ends, which part it from a name."""
    inner = markdown.escape(text)
    before = " " if text[:1].isspace() and inner else ""
    after = " " if text[-1:].isspace() else ""
    return f"{before}{inner}{after}"
