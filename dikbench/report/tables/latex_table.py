r"""A table as LaTeX, as wide as a column of a two-column paper, to be taken in with \input.

booktabs, graphicx and xcolor are needed.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Sequence
from math import isnan
from unicodedata import decomposition

from dikbench.report.tables.table import (
    ALL,
    NOT_TOLD,
    Block,
    Column,
    Table,
    TableCell,
    TableRow,
    shown,
)

WIDTH_PT = 240.0
"""Width of a column of a two-column paper [pt]."""

EM_PT = 8.0
"""Size of the type [pt]: at most that of scriptsize."""

GAP_PT = 3.0
"""Twice the space on each side of a column [pt]."""

LARGEST_NAME_PT = 70.0
"""Names of formulations that are wider are broken [pt]."""

UNBROKEN = 8
"""Characters of a name between places where it may be broken."""

_WIDE = frozenset("ABCDEFGHIJKLMNOPQRSTUVWXYZmw%@&=+<>#~")
_NARROW = frozenset("ijltfr.,:;'|![]() /")

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
    of_blocks = [f"{block.setting}: {block.note}" for block in table.overall if block.note]
    notes = [f"% {escape(note)}" for note in (table.title, *table.notes, *of_blocks)]
    if not table.blocks:
        return "\n".join([*notes, f"% {escape(table.empty)}", ""])
    return "\n".join([*notes, _tabular(table, table.overall), ""])


def to_latex_per_family(table: Table) -> str:
    """A tabular per family, each under its name."""
    parts = []
    for family in dict.fromkeys(block.family for block in table.blocks if block.family != ALL):
        blocks = [block for block in table.blocks if block.family == family]
        heading = f"\\noindent{{\\bfseries {_breakable(family)}}}\\par\\smallskip"
        parts.append(f"{heading}\n\\noindent\n{_tabular(table, blocks)}\n\\par\\bigskip\n")
    return "\n".join(parts)


def _tabular(table: Table, blocks: Sequence[Block]) -> str:
    r"""A tabular of the first columns that fit; best in bold, what cannot be trusted in grey.

    Headings stand upright, names of formulations are broken where they are long, and a solver is
    named where a formulation has several.
    """
    rows = [row for block in blocks for row in block.rows]
    solvers: dict[str, set[str]] = {}
    for row in rows:
        solvers.setdefault(row.formulation, set()).add(row.solver)

    def name(formulation: str, solver: str) -> str:
        several = len(solvers[formulation]) > 1
        return f"{formulation}, {solver}" if several else formulation

    names = [name(row.formulation, row.solver) for row in rows]
    first = min(max(map(_width, [*names, "formulation"])), LARGEST_NAME_PT)
    places = _fitting(table, rows, WIDTH_PT - first)
    columns = [table.columns[place] for place in places]
    headings = ["formulation", *(_upright(column.heading) for column in columns)]
    lines = [
        r"{\scriptsize\setlength{\tabcolsep}{1.5pt}%",
        f"\\begin{{tabular}}{{@{{}}p{{{first:.1f}pt}}{'r' * len(columns)}@{{}}}}",
        r"\toprule",
        _line(headings),
    ]
    for block in blocks:
        lines.append(r"\midrule")
        if block.setting:
            across = 1 + len(columns)
            lines.append(f"\\multicolumn{{{across}}}{{@{{}}l}}{{\\emph{{{_setting(block)}}}}} \\\\")
        for row in block.rows:
            cells = map(_cell, columns, (row.cells[place] for place in places))
            lines.append(_line([_breakable(name(row.formulation, row.solver)), *cells]))
    return "\n".join([*lines, r"\bottomrule", r"\end{tabular}}"])


def _setting(block: Block) -> str:
    """Plant and reference mode in words, short ones."""
    return escape(block.setting if len(block.setting) < 45 else block.setting.partition(" (")[0])


def _fitting(table: Table, rows: Sequence[TableRow], room: float) -> list[int]:
    """The places of the columns that are shown, in their order, as long as there is room [pt]."""
    found = []
    for place in table.shown:
        column = table.columns[place]
        texts = [_cell(column, row.cells[place]) for row in rows]
        room -= GAP_PT + max([EM_PT, *(_width(_plain(text)) for text in texts)])
        if room < 0:
            break
        found.append(place)
    return found


def _plain(text: str) -> str:
    """What is printed of a number, about as wide."""
    text = text.replace(r"\times", "+").replace(r"\infty", "m")
    return re.sub(r"\\[a-z]+|\{gray\}|[{}$^]", "", text)


def _width(text: str) -> float:
    """A bound of the width of a text in bold type of the size [pt]."""
    wide = sum(character in _WIDE or not character.isascii() for character in text)
    narrow = sum(character in _NARROW for character in text)
    rest = len(text) - wide - narrow
    return EM_PT * (0.95 * wide + 0.45 * narrow + 0.6 * rest)


def _breakable(name: str) -> str:
    """A name that may be broken after every few characters, flush left."""
    line = " ".join(name.split())
    if _width(line) <= LARGEST_NAME_PT:
        return escape(line)
    parts = [line[start : start + UNBROKEN] for start in range(0, len(line), UNBROKEN)]
    return r"\raggedright\hspace{0pt}" + r"\allowbreak ".join(map(escape, parts)) + r"\par"


def _upright(text: str) -> str:
    """A heading that is read from below."""
    return f"\\rotatebox{{90}}{{{escape(text)}}}"


def _line(cells: Iterable[str]) -> str:
    return " & ".join(cells) + r" \\"


def _cell(column: Column, cell: TableCell) -> str:
    if cell.text:
        return r"\textendash" if cell.text == NOT_TOLD else escape(cell.text)
    if isnan(cell.value):
        return ""
    if column.count:
        return str(int(cell.value))
    text = f"{cell.value:.0f}" if column.whole else _number(cell.value, column.most)
    if cell.best:
        text = f"\\textbf{{\\boldmath{text}}}" if "$" in text else f"\\textbf{{{text}}}"
    return f"\\textcolor{{gray}}{{{text}}}" if cell.unstable else text


def _number(value: float, most: float) -> str:
    r"""A number in text, a power of ten as \times 10^k; what is just beyond a limit as >."""
    text = shown(value)
    if shown(value, most) != text:  # there is no room for more digits
        return f"$>${text}"
    if "inf" in text:
        return text.replace("inf", r"$\infty$").replace("-", "$-$")
    mantissa, _, exponent = text.partition("e")
    if not exponent:
        return text.replace("-", "$-$")
    return f"${mantissa} \\times 10^{{{int(exponent)}}}$"
