r"""A table as LaTeX: tabulars that a paper takes in with \input; booktabs and xcolor are needed."""

from __future__ import annotations

from collections.abc import Iterable
from math import isnan
from textwrap import wrap
from unicodedata import decomposition

from dikbench.report.tables.table import ALL, Block, Column, Table, TableCell, shown

HEADING = 12
"""Characters to a line of a heading, unless a word is longer."""

_ESCAPES = str.maketrans(
    {
        "\\": r"\textbackslash{}",
        "_": r"\_",
        "%": r"\%",
        "&": r"\&",
        "#": r"\#",
        "$": r"\$",
        "{": r"\{",
        "}": r"\}",
        "~": r"\textasciitilde{}",
        "^": r"\textasciicircum{}",
        "<": r"\textless{}",
        ">": r"\textgreater{}",
        "|": r"\textbar{}",
        '"': "{''}",
        "[": "{[}",  # after \\ it would open an optional argument
        "]": "{]}",
        "`": r"\textasciigrave{}",
        "'": r"\textquotesingle{}",
        "-": "{-}",  # no dashes of two
    }
)


_ACCENTED = frozenset(
    character for character in map(chr, range(0xC0, 0x100)) if decomposition(character)
)
"""What any LaTeX sets beside ASCII: letters with an accent."""


def escape(text: str) -> str:
    """Text as one line of LaTeX that prints it as it is; what has no glyph for sure as `?`."""
    line = " ".join(text.split())
    return "".join(
        character.translate(_ESCAPES) if " " <= character <= "~" or character in _ACCENTED else "?"
        for character in line
    )


def to_latex(table: Table) -> str:
    """The part over all families as one tabular, a section per plant and reference mode."""
    notes = [f"% {escape(note)}" for note in (table.title, *table.notes)]
    return "\n".join([*notes, "", _tabular(table, table.overall), ""])


def to_latex_per_family(table: Table) -> str:
    """A tabular per family, each under its name."""
    parts = []
    for family in dict.fromkeys(block.family for block in table.blocks if block.family != ALL):
        blocks = [block for block in table.blocks if block.family == family]
        heading = f"\\noindent\\textbf{{{escape(family)}}}\\par\\smallskip"
        parts.append(f"{heading}\n\\noindent\n{_tabular(table, blocks)}\n\\par\\bigskip\n")
    return "\n".join(parts)


def _tabular(table: Table, blocks: Iterable[Block]) -> str:
    r"""A tabular; best in bold, what cannot be trusted in grey (\textcolor, xcolor or color)."""
    columns = [table.columns[place] for place in table.shown]
    width = 2 + len(columns)
    headings = ["formulation", "solver", *(_heading(column.heading) for column in columns)]
    lines = [
        f"\\begin{{tabular}}{{ll{'r' * len(columns)}}}",
        r"\toprule",
        _line(headings),
    ]
    for block in blocks:
        lines.append(r"\midrule")
        if block.setting:
            lines.append(f"\\multicolumn{{{width}}}{{l}}{{\\emph{{{escape(block.setting)}}}}} \\\\")
        for row in block.rows:
            cells = map(_cell, columns, (row.cells[place] for place in table.shown))
            lines.append(_line([escape(row.formulation), escape(row.solver), *cells]))
    return "\n".join([*lines, r"\bottomrule", r"\end{tabular}"])


def _heading(text: str) -> str:
    """A heading in short lines, one above the other."""
    lines = [escape(line) for line in wrap(text, HEADING)]
    stacked = r" \\ ".join(lines)
    return f"\\shortstack[r]{{{stacked}}}"


def _line(cells: Iterable[str]) -> str:
    return " & ".join(cells) + r" \\"


def _cell(column: Column, cell: TableCell) -> str:
    if cell.text:
        return escape(cell.text)
    if isnan(cell.value):
        return ""
    if column.count:
        return str(int(cell.value))
    text = _number(cell.value)
    if cell.best:
        text = f"\\textbf{{\\boldmath{text}}}" if "$" in text else f"\\textbf{{{text}}}"
    if cell.has_interval:
        text += f" {{\\scriptsize[{_number(cell.lower)}, {_number(cell.upper)}]}}"
    return f"\\textcolor{{gray}}{{{text}}}" if cell.unstable else text


def _number(value: float) -> str:
    r"""A number in text, a power of ten as \times 10^k."""
    text = shown(value)
    if "inf" in text:
        return text.replace("inf", r"$\infty$").replace("-", "$-$")
    mantissa, _, exponent = text.partition("e")
    if not exponent:
        return text.replace("-", "$-$")
    return f"${mantissa} \\times 10^{{{int(exponent)}}}$"
