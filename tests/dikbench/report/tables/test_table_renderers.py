"""Tables as text: Markdown, LaTeX, CSV and the console, with names that mean harm."""

from __future__ import annotations

import csv
import io
import math
import re
import shutil
import subprocess
from dataclasses import replace
from pathlib import Path

import pandas as pd
import pytest
from hypothesis import given
from hypothesis import strategies as st
from makers.rows import Values, make_rows

from dikbench.report.selection.judged import DEFINITIONS
from dikbench.report.tables import latex_table, markdown
from dikbench.report.tables.console import NAME, ROWS, WIDTH, to_text
from dikbench.report.tables.csv_table import to_csv
from dikbench.report.tables.every import make_tables
from dikbench.report.tables.files import write_table
from dikbench.report.tables.latex_table import to_latex, to_latex_per_family
from dikbench.report.tables.markdown import markdown_blocks, markdown_rows, to_markdown
from dikbench.report.tables.success import success_table
from dikbench.report.tables.table import (
    NOT_TOLD,
    Block,
    Column,
    Table,
    TableCell,
    TableRow,
    shown,
)

HOSTILE = (
    "<script>alert('x')</script>",
    '100% of \\ {a} $b$ ~ ^ # & _under_ `tick` "quote"',
    "../../etc/passwd",
    "pipe|and\nline\r\nbreak\ttab",
    "[click](javascript:alert(1)) ![i](x)",
    "\\end{tabular}\\input{/etc/passwd}% \\",
    "*bold* **more** __dunder__ ~~gone~~",
    "mosaïque ⟂ \x1b[31mred\x00",
    "[first]",
)

COLUMNS = (
    Column("stopped_percent", "stopped [%]", "mean of: stopped", "low", interval=True, whole=True),
    Column("hidden", "hidden", "number of: what stands in the CSV alone", count=True, shown=False),
    Column("runs", "runs", "number of: trials", count=True),
    Column("error_mm", "error [mm]", "median of: <error>", "low", interval=True),
    Column("speed_worst", "speed worst", "worst of: speed", "low"),
)


def _row(name: str, solver: str, *cells: TableCell) -> TableRow:
    return TableRow(name, solver, (TableCell(0.0), TableCell(0.0), TableCell(8.0), *cells))


def _table(rows: list[TableRow], family: str = "reach") -> Table:
    blocks = [Block(name, "ideal", "time", tuple(rows)) for name in ("all", family)]
    return Table("made_up", "Made up", COLUMNS, tuple(blocks), ("error [m]: it is 1 % off",))


PLAIN = _table(
    [
        _row("pinv", "none", TableCell(0.01234, 0.0101, 0.0155, best=True), TableCell(math.inf)),
        _row("qp", "daqp", TableCell(0.5, 0.5, 0.5), TableCell(12345.6, unstable=True)),
        _row("lost", "none", TableCell(math.nan), TableCell(-2.5e-7, best=True, unstable=True)),
    ]
)
HARMFUL = _table(
    [_row(name, name, TableCell(1.0), TableCell(2.0)) for name in HOSTILE], family="<b>|100%\n# _"
)


def _unescaped(text: str) -> list[str]:
    """The cells of a line of a Markdown table, as GitHub's parser splits it."""
    return [cell.strip() for cell in re.split(r"(?<!\\)(?:\\\\)*\|", text)[1:-1]]


@pytest.mark.parametrize(
    ("value", "text"),
    [
        (0.0123456, "0.0123"),
        (1.0, "1"),
        (12345.6, "12300"),
        (999.9, "1000"),
        (2.5e7, "2.5e+07"),
        (1e-5, "1e-05"),
        (-4e-10, "0"),
        (math.inf, "inf"),
        (-0.25, "-0.25"),
    ],
)
def test_numbers_are_shown_to_three_digits(value: float, text: str) -> None:
    """Rounding is 0; what an eye takes in needs no exponent."""
    assert shown(value) == text


def test_markdown_marks_the_best_intervals_and_what_is_unstable() -> None:
    """Bold, brackets, a dagger; an interval that is the value itself is not repeated."""
    lines = markdown_blocks(PLAIN, PLAIN.overall).splitlines()
    assert lines[0] == "the clock does not wait (ideal plant):"
    assert _unescaped(lines[4])[2:] == ["0", "8", "**0.0123** [0.0101, 0.0155]", "∞"]
    assert _unescaped(lines[5])[2:] == ["0", "8", "0.5", "12300†"]
    assert _unescaped(lines[6])[2:] == ["0", "8", "", "**-2.5e-07**†"]
    assert len({len(line) for line in lines[2:]}) == 1


def test_latex_marks_the_best_and_what_is_unstable() -> None:
    r"""\textbf, \textcolor{gray}; exponents as powers, a minus as a minus; upright headings."""
    text = to_latex(PLAIN)
    assert r"pinv & 0 & 8 & \textbf{0.0123} & $\infty$ \\" in text
    assert r"qp & 0 & 8 & 0.5 & \textcolor{gray}{12300} \\" in text
    assert r"lost & 0 & 8 &  & \textcolor{gray}{\textbf{\boldmath$-2.5 \times 10^{-7}$}} \\" in text
    assert text.count(r"\begin{tabular}") == text.count(r"\end{tabular}") == 1
    assert r"\rotatebox{90}{stopped {[}\%{]}} & " in text
    assert r"{\bfseries reach}" in to_latex_per_family(PLAIN)


def test_latex_names_the_solver_where_there_are_several() -> None:
    """And only there; who does not see obstacles has a dash."""
    rows = [
        _row("qp", "daqp", TableCell(1.0), TableCell(2.0)),
        _row("qp", "osqp", TableCell(1.0, text=NOT_TOLD), TableCell(2.0)),
        _row("lp", "highs", TableCell(1.0), TableCell(2.0)),
    ]
    text = to_latex(_table(rows))
    assert "qp, daqp & 0 & 8 & 1 & 2" in text
    assert r"qp, osqp & 0 & 8 & \textendash & 2" in text
    assert "lp & 0 & 8 & 1 & 2" in text


def test_csv_holds_plain_numbers_and_their_bounds() -> None:
    """In full, empty where there is none, whole where they are counts, hidden columns too."""
    rows = list(csv.DictReader(io.StringIO(to_csv(PLAIN))))
    assert len(rows) == 6
    first = {
        "family": "all", "plant": "ideal", "reference": "time", "formulation": "pinv",
        "solver": "none", "stopped_percent": "0.0", "stopped_percent_lower": "",
        "stopped_percent_upper": "", "hidden": "0", "runs": "8", "error_mm": "0.01234",
        "error_mm_lower": "0.0101", "error_mm_upper": "0.0155", "speed_worst": "inf",
    }  # fmt: skip
    assert rows[0] == first
    assert (rows[2]["error_mm"], rows[2]["speed_worst"]) == ("", "-2.5e-07")


def test_the_console_fits_a_screen() -> None:
    """No line is wider, no block longer, and what was left out is said."""
    wide = tuple(Column(f"c{i}", f"heading number {i} [rad/s]", "number", "low") for i in range(30))
    rows = [
        TableRow(
            f"formulation{i:02}[parameter={'x' * 90}]",
            "daqp",
            tuple(TableCell(float(i)) for _ in range(33)),
        )
        for i in range(40)
    ]
    blocks = [Block("all", plant, "time", tuple(rows[::-1])) for plant in "abc"]
    table = Table("made_up", "Made up", (*COLUMNS[:3], *wide), tuple(blocks), ())
    text = to_text(table)
    assert max(map(len, text.splitlines())) <= WIDTH
    assert 0 < text.count("formulation") < 2 * (ROWS + 2) + 4
    assert text.count("and 16 more: tables/made_up.md") == 2
    assert "(1): tables/made_up.md" in text
    assert text.index("formulation39") < text.index("formulation38")  # in the study's order
    assert "heading" in text


def test_the_console_stars_the_first_and_rounds_shares() -> None:
    """A line per formulation; a question mark after times that cannot be trusted."""
    lines = to_text(PLAIN).splitlines()
    assert lines[0] == "Made up"
    assert re.fullmatch(r"pinv +0 +8 +0\.0123\* +inf", lines[5])
    assert re.fullmatch(r"qp, daqp +0 +8 +0\.5 +12300\?", lines[6])
    assert re.fullmatch(r"lost +0 +8 +-2\.5e-07\?\*", lines[7])


def test_hostile_names_stay_text_in_markdown() -> None:
    """A row keeps its number of cells, and no tag, link, emphasis or control character is left."""
    text = to_markdown(HARMFUL)
    rows = [line for line in text.splitlines() if line.startswith("|")]
    assert len(rows) == 2 * (2 + len(HOSTILE))
    assert {len(_unescaped(row)) for row in rows} == {1 + len(COLUMNS)}
    assert "<" not in text
    assert ">" not in text
    assert "](" not in text
    assert not re.search(r"(?<!\\)[`*~$]", text)
    assert all(character.isprintable() or character == "\n" for character in text)
    assert "## &lt;b&gt;\\|100% # \\_" in text
    assert "pipe\\|and line break tab" in text
    assert "pinv[after=clip]" == markdown.escape("pinv[after=clip]")
    assert "eps_abs=1e-6" == markdown.escape("eps_abs=1e-6")


def test_hostile_names_in_a_plain_markdown_table() -> None:
    """The table of return codes escapes them too."""
    text = markdown_rows(pd.DataFrame({"solver": ["<b>|*x*"], "right": [0.25]}))
    assert "| &lt;b&gt;\\|\\*x\\* |  0.25 |" in text


def test_hostile_names_stay_text_in_latex() -> None:
    """As many cells to a row as without them; no name is taken for an argument of a line's end."""
    text = to_latex(HARMFUL)
    rows = [line for line in text.splitlines() if line.endswith(r"& 0 & 8 & 1 & 2 \\")]
    assert len(rows) == len(HOSTILE)
    assert {len(re.split(r"(?<!\\)&", row)) for row in rows} == {len(COLUMNS)}
    assert not re.search(r"\\\\\s*\[", text)
    assert "{[}first{]}" in text


def _groups_balance(text: str) -> bool:
    depth = 0
    for brace in re.findall(r"(?<!\\)[{}]", text.replace("\\\\", "")):
        depth += 1 if brace == "{" else -1
        if depth < 0:
            return False
    return depth == 0


@given(st.text(max_size=40))
def test_any_name_is_one_cell_of_latex(name: str) -> None:
    """Balanced groups, no comment, no separator, no command but those for characters."""
    text = latex_table.escape(name)
    assert _groups_balance(text)
    assert not re.search(r"(?<!\\)[%&#$_^~]", text)
    commands = set(re.findall(r"\\([a-z]+)", text))
    assert all(command.startswith("text") for command in commands)
    assert text.isprintable()


@given(st.text(max_size=40))
def test_any_name_is_one_cell_of_markdown(name: str) -> None:
    """One line, and as many cells as without it."""
    line = f"| {markdown.escape(name)} | x |"
    assert line.isprintable()
    assert len(_unescaped(line)) == 2


LONG = _table(
    [
        _row(
            f"{'W' * 30}[gain={'0' * 20},after=scale]",
            "daqp[then=clarabel]",
            TableCell(-1.23e-30, best=True),
            TableCell(-4.56e30, unstable=True),
        ),
        _row("a-b_" * 40, "none", TableCell(0.1), TableCell(1.0)),
    ],
    family="x" * 90,
)


@pytest.mark.skipif(shutil.which("pdflatex") is None, reason="there is no pdflatex")
def test_latex_fits_a_column(tmp_path: Path, made_up_trials: pd.DataFrame) -> None:
    """Every table of a study, and names that mean harm: compiled, and no box is overfull."""
    names: dict[str | tuple[str, str], Values] = {"condition-governor": {}, "W" * 30: {}}
    rows = [
        make_rows(names, [f"f{k}"]).assign(situation=situation)
        for k, situation in enumerate(DEFINITIONS)
    ]
    full = success_table(pd.concat(rows, ignore_index=True))
    assert to_latex(full).count("rotatebox") == len(full.shown) == 10
    tables = [*make_tables(made_up_trials), HARMFUL, LONG, full]
    inputs = []
    for number, table in enumerate(tables):
        write_table(replace(table, name=f"t{number}"), tmp_path / "tables")
        for end in ("", "_per_family"):
            inputs.append(f"\\noindent\\input{{tables/t{number}{end}.tex}}\\clearpage\n")
    document = (
        "\\documentclass{article}\\usepackage{booktabs,graphicx,xcolor}\n"
        "\\setlength{\\textwidth}{240pt}\\setlength{\\textheight}{5000pt}\\raggedbottom\n"
        f"\\begin{{document}}\n{''.join(inputs)}\\end{{document}}\n"
    )
    (tmp_path / "paper.tex").write_text(document, encoding="utf-8")
    command = ["pdflatex", "-interaction=nonstopmode", "-halt-on-error", "paper.tex"]
    done = subprocess.run(command, cwd=tmp_path, capture_output=True, text=True, errors="replace")
    assert done.returncode == 0, done.stdout[-2000:]
    assert "Overfull \\hbox" not in done.stdout, done.stdout[-4000:]


def test_latex_leaves_out_what_finds_no_room() -> None:
    """Columns are taken from the first as long as they fit; at least the widest stay inside."""
    wide = tuple(Column(f"c{i}", f"c{i}", "a number", "low") for i in range(30))
    row = TableRow("a", "none", tuple(TableCell(1.23e-7) for _ in wide))
    text = to_latex(Table("w", "W", wide, (Block("all", None, None, (row,)),), ()))
    assert 3 <= text.count("rotatebox") < 10


def test_names_on_the_console_are_one_short_line() -> None:
    """Without escape sequences, which would colour the terminal."""
    text = to_text(HARMFUL)
    assert "\x1b" not in text
    assert "pipe|and line break tab" in text
    assert all(len(line) <= WIDTH for line in text.splitlines())
    assert NAME < WIDTH
