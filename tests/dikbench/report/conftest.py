"""Tables of trials made up for figures, and the figures that are drawn of them."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest

from dikbench.metrics import METRICS
from dikbench.report.drawing import style as style_module
from dikbench.results.columns import CONTROL_RATES_HZ, TIMES
from dikbench.results.selected import with_selected

MakeTrials = Callable[..., pd.DataFrame]


def made_up(
    contenders: Iterable[str | tuple[str, str]],
    scenarios: Iterable[str],
    seeds: Iterable[int] = (0,),
    plants: Iterable[str] = ("ideal",),
) -> pd.DataFrame:
    """A row, with every column of trials.csv, for each law (or law and solver) and scenario.

    The numbers are drawn at random, always the same ones: positive, progress below 1, stable times.
    """
    pairs = [
        contender if isinstance(contender, tuple) else (contender, "none")
        for contender in contenders
    ]
    cells = pd.MultiIndex.from_product(
        [range(len(pairs)), scenarios, plants, ["time"], seeds],
        names=["contender", "scenario", "plant", "reference", "seed"],
    ).to_frame(index=False)
    table = pd.DataFrame(
        {
            "id": [f"{number:016x}" for number in range(len(cells))],
            "formulation": [pairs[number][0] for number in cells["contender"]],
            "solver": [pairs[number][1] for number in cells["contender"]],
            **{name: cells[name] for name in ("scenario", "plant", "reference", "seed")},
            "status": "ok",
            "message": "",
            "steps": 100,
        }
    )
    random = np.random.default_rng(0)
    drawn = {name: random.lognormal(-4.0, 1.0, len(table)) for name in (*METRICS, *TIMES)}
    table = table.assign(**drawn | {"timing_samples": 100, "timing_stability": "stable"})
    table["progress_mean"] = table["progress_min"] = 1.0 - table["progress_mean"].clip(upper=1.0)
    return with_selected(
        table.assign(**{f"missed_{rate}_hz_share": 0.0 for rate in CONTROL_RATES_HZ})
    )


@pytest.fixture
def make_trials() -> MakeTrials:
    """See `made_up`."""
    return made_up


@pytest.fixture
def drawn(monkeypatch: pytest.MonkeyPatch) -> list[Any]:
    """The figures that are drawn, in their order, open to be read."""
    kept: list[Any] = []
    close = style_module.plt.close

    def keep(figure: Any) -> None:
        kept.append(figure)
        close(figure)

    monkeypatch.setattr(style_module.plt, "close", keep)
    return kept


@pytest.fixture
def target(tmp_path: Path) -> Path:
    """An empty folder of figures."""
    folder = tmp_path / "figures"
    folder.mkdir()
    return folder
