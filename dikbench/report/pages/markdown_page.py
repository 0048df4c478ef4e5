"""report.md: the report in short, for a forge."""

from __future__ import annotations

import jinja2

from dikbench.report.contents.contents import Contents
from dikbench.report.pages.backticks import to_markdown
from dikbench.report.sentences.words import quoted
from dikbench.report.tables.markdown import escape, markdown_blocks, markdown_rows


def render_markdown(contents: Contents) -> str:
    """The page."""
    environment = jinja2.Environment(
        loader=jinja2.PackageLoader("dikbench.report.pages"),
        autoescape=False,  # Markdown, not HTML: filters escape it
        undefined=jinja2.StrictUndefined,
        trim_blocks=True,
        keep_trailing_newline=True,
    )
    environment.filters |= {
        "md": escape,
        "quoted": quoted,
        "spoken": to_markdown,
        "blocks": lambda table: markdown_blocks(table, table.overall),
        "rows": markdown_rows,
        "capitalize_first": lambda text: text[:1].upper() + text[1:],
    }
    return environment.get_template("report.md.j2").render(contents=contents)
