"""A formulation against others, as text, Markdown, CSV or LaTeX."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import fields
from types import MappingProxyType
from typing import Final

import pandas as pd

from dikbench.report.comparison.formulations import Interval, Pair
from dikbench.report.selection.judged import IN_WORDS, SETTINGS
from dikbench.report.tables import latex_table, markdown
from dikbench.statistics.accuracy import ACCURACY, SMALLEST_DISTANCE_M
from dikbench.statistics.success import Setting

Rows = list[list[str]]

SUCCESS: Final = (
    "situation", "against", "cases", "A %", "B %", "A - B [points]", "won/lost", "odds", "p",
)  # fmt: skip
ACCURACY_AND_TIME: Final = (
    "situation", "against", "both", "error A/B", "rank-bis.", "duration A/B",
)  # fmt: skip
TITLES: Final = ("Success", "Accuracy and slow-down where both succeed")
NAMES: Final = 2
"""The first columns are names, the others numbers."""


def notes(pairs: Sequence[Pair], plant: str) -> list[str]:
    """Say how the numbers were taken."""
    overall = sum(pair.situation.endswith("situations") for pair in pairs)
    return [
        f"A is {pairs[0].a}; rows compare it, over the cases that both ran, on the {plant} plant. "
        "A case is a scenario and seed that a known motion can do.",
        "A - B [points]: paired difference of the rates of success (means over families, robots, "
        "scenarios and seeds), with its 95 % interval by a bootstrap over the same; no interval "
        "where all cases agree.",
        "won/lost: scenarios in which A succeeds with more seeds than B, and with fewer. odds: won "
        "over lost (conditional odds ratio of the discordant pairs). p: exact two-sided McNemar "
        f"test of won and lost, by Holm's correction over the {overall} rows of all or kinematic "
        "situations, and over the others.",
        f"error A/B: geometric mean of the ratios of {ACCURACY} (less than "
        f"{1e3 * SMALLEST_DISTANCE_M:g} mm counts as that) where both succeed and there is a path, "
        "with its 95 % interval; below 1, A is the more accurate. rank-bis.: matched-pairs "
        "rank-biserial correlation of the same, 1 where A is the more accurate in all "
        "cases and -1 where in none.",
        "duration A/B: the same ratio of the slow-down, where the path may wait.",
    ]


def to_text(pairs: Sequence[Pair], plant: str) -> str:
    """Write two tables per setting as plain text, the notes last."""
    parts = [
        f"{title}, {IN_WORDS[setting]}\n{_plain(header, rows)}"
        for setting, title, header, rows in _tables(pairs)
    ]
    return "\n\n".join([*parts, *notes(pairs, plant)])


def to_markdown(pairs: Sequence[Pair], plant: str) -> str:
    """Write two tables per setting as Markdown, the notes last."""
    parts = [
        f"## {title}, {IN_WORDS[setting]}\n\n"
        + markdown.aligned(
            list(map(markdown.escape, header)),
            [list(map(markdown.escape, row)) for row in rows],
            [place >= NAMES for place in range(len(header))],
        )
        for setting, title, header, rows in _tables(pairs)
    ]
    told = "\n".join(f"- {markdown.escape(note)}" for note in notes(pairs, plant))
    return "\n\n".join([*parts, told])


def to_latex(pairs: Sequence[Pair], plant: str) -> str:
    r"""Write two tabulars per setting, which need booktabs, with the notes as comments."""
    escape = latex_table.escape
    parts = ["\n".join(f"% {escape(note)}" for note in notes(pairs, plant))]
    for setting, title, header, rows in _tables(pairs):
        columns = "l" * NAMES + "r" * (len(header) - NAMES)
        lines = [
            f"% {escape(title)}, {IN_WORDS[setting]}",
            f"\\begin{{tabular}}{{{columns}}}",
            r"\toprule",
            " & ".join(map(escape, header)) + r" \\",
            r"\midrule",
            *(" & ".join(map(escape, row)) + r" \\" for row in rows),
            r"\bottomrule",
            r"\end{tabular}",
        ]
        parts.append("\n".join(lines))
    return "\n\n".join(parts)


def to_csv(pairs: Sequence[Pair], plant: str) -> str:
    """Write a row per pair with every number in full; intervals as two columns."""
    rows = []
    for pair in pairs:
        row: dict[str, object] = {"plant": plant}
        for field in fields(Pair):
            value = getattr(pair, field.name)
            if isinstance(value, tuple):
                stem = field.name.removesuffix("_interval")
                row |= {f"{stem}_low": value[0], f"{stem}_high": value[1]}
            else:
                row[field.name] = value
        rows.append(row)
    return pd.DataFrame(rows).to_csv(index=False).rstrip("\n")


FORMATS: Final[Mapping[str, Callable[[Sequence[Pair], str], str]]] = MappingProxyType(
    {"text": to_text, "markdown": to_markdown, "csv": to_csv, "latex": to_latex}
)
"""The writers by what they write."""


def _tables(pairs: Sequence[Pair]) -> list[tuple[Setting, str, Sequence[str], Rows]]:
    """Return the tables: setting, title, header and rows."""
    found: list[tuple[Setting, str, Sequence[str], Rows]] = []
    for setting in SETTINGS:
        here = [pair for pair in pairs if pair.setting == setting]
        if not here:
            continue
        found.append((setting, TITLES[0], SUCCESS, [_success(pair) for pair in here]))
        common = [_accuracy(pair) for pair in here if pair.both]
        if common:
            found.append((setting, TITLES[1], ACCURACY_AND_TIME, common))
    return found


def _success(pair: Pair) -> list[str]:
    if pair.unseen:
        return [pair.situation, f"{pair.b} ({pair.unseen})", *[""] * (len(SUCCESS) - NAMES)]
    points = (100 * pair.difference_interval[0], 100 * pair.difference_interval[1])
    return [
        pair.situation,
        pair.b,
        str(pair.cases),
        f"{100 * pair.rate_a:.1f}",
        f"{100 * pair.rate_b:.1f}",
        f"{100 * pair.difference:+.1f}{_interval(points, '{:+.1f}')}",
        f"{pair.only_a}/{pair.only_b}",
        _number(pair.odds_ratio, "{:.2g}"),
        _p(pair.p_holm),
    ]


def _accuracy(pair: Pair) -> list[str]:
    return [
        pair.situation,
        pair.b,
        str(pair.both),
        f"{_number(pair.error_ratio)}{_interval(pair.error_interval)}",
        _number(pair.rank_biserial, "{:+.2f}"),
        f"{_number(pair.duration_ratio)}{_interval(pair.duration_interval)}",
    ]


def _number(value: float, shown: str = "{:.3g}") -> str:
    return "" if math.isnan(value) else shown.format(value)


def _interval(ends: Interval, shown: str = "{:.3g}") -> str:
    if math.isnan(ends[0]):
        return ""
    return f" [{shown.format(ends[0])}, {shown.format(ends[1])}]"


def _p(value: float) -> str:
    return "< 0.0001" if value < 1e-4 else f"{value:.2g}"


def _plain(header: Sequence[str], rows: Rows) -> str:
    """Write columns of one width each, names to the left and numbers to the right."""
    widths = [max(len(row[place]) for row in (header, *rows)) for place in range(len(header))]

    def line(row: Sequence[str]) -> str:
        cells = (
            text.ljust(width) if place < NAMES else text.rjust(width)
            for place, (text, width) in enumerate(zip(row, widths, strict=True))
        )
        return "  ".join(cells).rstrip()

    return "\n".join(map(line, [header, *rows]))
