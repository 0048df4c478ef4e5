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
    close = plt.close

    def keep(figure: Any) -> None:
        kept.append(figure)
        close(figure)

    monkeypatch.setattr(plt, "close", keep)
    monkeypatch.setattr(FigureCanvasAgg, "print_png", lambda canvas, file: file.touch())
    return kept


@pytest.fixture
def target(tmp_path: Path) -> Path:
    """An empty folder of figures."""
    folder = tmp_path / "figures"
    folder.mkdir()
    return folder
