"""The figures that are drawn, open to be read; a page to be played."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import matplotlib.pyplot as plt
import pandas as pd
import pytest
from makers.browser import browser_with
from makers.played import at, ran, reset
from makers.shared import made_once
from matplotlib.backends.backend_agg import FigureCanvasAgg

from dikbench.report.interactive.page_rows import page_rows
from dikbench.results.reading import read_results, without_attributes


@pytest.fixture
def drawn(monkeypatch: pytest.MonkeyPatch) -> list[Any]:
    """The figures that are drawn, in their order, open to be read; their PNGs are empty."""
    kept: list[Any] = []
    close, print_png = plt.close, FigureCanvasAgg.print_png

    def keep(figure: Any) -> None:
        kept.append(figure)
        close(figure)

    def print_empty(canvas: Any, file: Any, **options: Any) -> None:
        if isinstance(file, Path):
            file.touch()
        else:  # a picture inside an SVG
            print_png(canvas, file, **options)

    monkeypatch.setattr(plt, "close", keep)
    monkeypatch.setattr(FigureCanvasAgg, "print_png", print_empty)
    return kept


@pytest.fixture
def target(tmp_path: Path) -> Path:
    """An empty folder of figures."""
    folder = tmp_path / "figures"
    folder.mkdir()
    return folder


@pytest.fixture(scope="session")
def played(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The results of a study, with its page."""
    return made_once(tmp_path_factory, "played", ran) / "out"


@pytest.fixture(scope="session")
def trials(played: Path) -> pd.DataFrame:
    """The trials of the study."""
    return without_attributes(read_results(played)).trials


@pytest.fixture(scope="session")
def rows(trials: pd.DataFrame) -> pd.DataFrame:
    """The rows of its page."""
    return page_rows(trials)


@pytest.fixture(scope="module")
def browser(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Any]:
    """A browser with a profile of its own."""
    with browser_with(tmp_path_factory.mktemp("profile")) as driver:
        yield driver


@pytest.fixture
def page(browser: Any, played: Path) -> Any:
    """The page with its controls as at first, left open by another test where it was."""
    if browser.current_url.startswith("file") and "picked" not in browser.current_url:
        reset(browser)
        return browser
    return at(browser, played)
