"""All figures of a results folder: which are drawn, of what input, and that none is a danger."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

import numpy as np
import pandas as pd
import pytest
from makers.rows import random_rows

from dikbench.metrics import METRICS
from dikbench.report.drawing.figure import Figure
from dikbench.report.drawing.style import file_name, short
from dikbench.report.figures.every import draw_figures
from dikbench.results.columns import TIMES
from dikbench.results.folder import ResultsFolder

LAWS: list[str | tuple[str, str]] = [
    "dls[damping=0.1]",
    "dls[damping=0.2]",
    "dls[damping=0.3]",
    ("qp", "daqp"),
]
SCENARIOS = [f"near-miss[miss={miss},speed={v}]" for miss in (0, 0.1, 0.2) for v in (1, 2)]

KINDS = {
    "phase_diagram_1_error.svg",
    "phase_diagram_1_peak_speed.svg",
    "phase_diagram_1_outcome.svg",
    "error_against_miss_1.svg",
    "peak_speed_against_miss_1.svg",
    "outcomes_clock.svg",
    "success_over_tolerance.svg",
    "formulation_dls_damping_1.svg",
    "time_per_formulation_and_solver.svg",
}


def drawn_in(folder: Path, trials: pd.DataFrame) -> list[Figure]:
    """Draw everything of a table without traces, and check that the files are there."""
    figures = draw_figures(ResultsFolder(folder), trials, {"study": {}})
    there = {path.name for path in (folder / "figures").iterdir()}
    assert there == {name for figure in figures for name in (figure.file, figure.png)}
    assert len({figure.file for figure in figures}) == len(figures)
    assert all(figure.caption and figure.title for figure in figures)
    return figures


def files(figures: Iterable[Figure]) -> set[str]:
    """The names of the SVGs."""
    return {figure.file for figure in figures}


@pytest.fixture(scope="module")
def whole(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, list[Figure]]:
    """A folder in which a table was drawn that has data for all figures, and the figures."""
    folder = tmp_path_factory.mktemp("whole")
    return folder, drawn_in(folder, random_rows(LAWS, SCENARIOS))


def test_every_kind_is_drawn(whole: tuple[Path, list[Figure]]) -> None:
    """A table that has data for every figure but those against time gives them all."""
    assert files(whole[1]) == KINDS


def test_the_same_table_gives_the_same_bytes(
    whole: tuple[Path, list[Figure]], tmp_path: Path
) -> None:
    """Drawn twice, every file is the same to the last byte."""
    drawn_in(tmp_path, random_rows(LAWS, SCENARIOS))
    first, second = (sorted((folder / "figures").iterdir()) for folder in (whole[0], tmp_path))
    assert [path.read_bytes() for path in first] == [path.read_bytes() for path in second]


def test_an_svg_may_stand_in_a_page(whole: tuple[Path, list[Figure]]) -> None:
    """No SVG has a style sheet, or names for groups that another one has too; each has a font."""
    folder, figures = whole
    for figure in figures:
        root = ElementTree.fromstring((folder / "figures" / figure.file).read_bytes())
        tags = [element.tag.rpartition("}")[2] for element in root.iter()]
        assert "style" not in tags
        assert "text" in tags
        assert not any("id" in group.attrib for group in root.iter("{http://www.w3.org/2000/svg}g"))
        assert "DejaVu Sans" in root.attrib["style"]
        assert "stroke-linejoin" in root.attrib["style"]


def _none(trials: pd.DataFrame) -> pd.DataFrame:
    return trials.iloc[:0]


def _skipped(trials: pd.DataFrame) -> pd.DataFrame:
    return trials.assign(status="skipped", steps=0)


def _one_law(trials: pd.DataFrame) -> pd.DataFrame:
    return trials[trials["formulation"] == "qp"]


def _one_trial(trials: pd.DataFrame) -> pd.DataFrame:
    return trials.iloc[:1]


def _failed(trials: pd.DataFrame) -> pd.DataFrame:
    return trials.assign(status="diverged", outcome="diverged", decided_before="diverged")


def _only_saturating(trials: pd.DataFrame) -> pd.DataFrame:
    return trials.assign(plant="saturating", reference="path", seed=7)


def _untimed(trials: pd.DataFrame) -> pd.DataFrame:
    return trials.assign(**dict.fromkeys(TIMES, np.nan))


def _without_numbers(trials: pd.DataFrame) -> pd.DataFrame:
    return trials.assign(**dict.fromkeys((*METRICS, *TIMES), np.nan))


def _zeros(trials: pd.DataFrame) -> pd.DataFrame:
    return trials.assign(**dict.fromkeys((*METRICS, *TIMES), 0.0))


def _infinite(trials: pd.DataFrame) -> pd.DataFrame:
    return trials.assign(**dict.fromkeys(METRICS, np.inf))


def _huge(trials: pd.DataFrame) -> pd.DataFrame:
    return trials.assign(**dict.fromkeys((*METRICS, *TIMES), 1e200))


TIMED = {"time_per_formulation_and_solver.svg"}
SUCCESS = {"outcomes_clock.svg", "success_over_tolerance.svg"}
OUTCOME = {"phase_diagram_1_outcome.svg", *SUCCESS}


@pytest.mark.parametrize(
    ("degenerate", "expected"),
    [
        (_none, set()),
        (_skipped, set()),
        pytest.param(_one_law, KINDS - {"formulation_dls_damping_1.svg"}, marks=pytest.mark.long),
        (_one_trial, {*TIMED, *SUCCESS}),
        (_failed, {*OUTCOME, "time_per_formulation_and_solver.svg"}),
        pytest.param(_only_saturating, None, marks=pytest.mark.long),
        pytest.param(_untimed, KINDS - TIMED, marks=pytest.mark.long),
        (_without_numbers, OUTCOME),
        pytest.param(_zeros, None, marks=pytest.mark.long),
        (_infinite, None),
        (_huge, None),
    ],
)
def test_a_figure_without_data_is_left_out(
    request: pytest.FixtureRequest,
    tmp_path: Path,
    degenerate: Callable[[pd.DataFrame], pd.DataFrame],
    expected: set[str] | None,
) -> None:
    """Of a degenerate table what can be drawn is drawn, without an error or a warning."""
    if degenerate not in (_infinite, _huge):
        request.getfixturevalue("drawn")  # PNGs are of numbers that are hard to draw
    found = files(drawn_in(tmp_path, degenerate(random_rows(LAWS, SCENARIOS))))
    possible = {*KINDS, "outcomes_path.svg", "success_against_slow_down.svg"}
    possible.add("success_against_time.svg")
    assert found == expected if expected is not None else found <= possible


HOSTILE = [
    "../../x",
    "<script>alert(1)</script>",
    "a\"b&c'd",
    "$x^{$",
    "\N{CJK UNIFIED IDEOGRAPH-540D}\x07\n",
    "formulation</svg>",
    "_hidden",
]


@pytest.mark.usefixtures("drawn")
def test_hostile_names_stay_text(tmp_path: Path) -> None:
    """Names that are markup, paths or formulas are written as they are, and in no file name."""
    formulations = [f"{HOSTILE[0]}[../p<={value}]" for value in (1, 2, 3)] + HOSTILE[1:]
    scenarios = [f"{HOSTILE[1]}[<b>/../={value}]" for value in (1, 2, 3)]
    figures = drawn_in(tmp_path, random_rows(formulations, scenarios))
    assert any("formulation_" in figure.file for figure in figures)
    written = ""
    for figure in figures:
        assert set(figure.file) <= set(file_name(figure.file[:-4]) + ".svg")
        root = ElementTree.fromstring((tmp_path / "figures" / figure.file).read_bytes())
        tags = {element.tag.rpartition("}")[2] for element in root.iter()}
        assert not tags & {"script", "a", "b", "foreignObject"}
        written += "\n".join(root.itertext())
    for name in (formulations[0], *HOSTILE[1:4]):
        assert short(name) in written


@pytest.mark.parametrize(
    ("parts", "name"),
    [
        (("formulation", "../../etc/passwd", 1), "formulation_etc-passwd_1"),
        (("<script>",), "script"),
        (("a/b\\c\0d", "", 2), "a-b-c-d_2"),
        (("x" * 300,), "x" * 40),
    ],
)
def test_file_names_are_safe(parts: tuple[Any, ...], name: str) -> None:
    """Only letters, digits, dashes and underscores are left of a word, and not too many."""
    assert file_name(*parts) == name


def test_a_long_name_keeps_its_ends() -> None:
    """What tells names apart stands at their beginning and their end."""
    name = short("qp[damping=0.001,regularization=1e-6]", 21)
    assert name == "qp[damping\N{HORIZONTAL ELLIPSIS}tion=1e-6]"
    assert short("dls") == "dls"
