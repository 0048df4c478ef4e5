"""The figures that are drawn, open to be read."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import matplotlib.pyplot as plt
import pytest
from matplotlib.backends.backend_agg import FigureCanvasAgg


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
