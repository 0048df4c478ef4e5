"""Rows of trials that nobody had to run, and results folders of them."""

from __future__ import annotations

import json
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any, Final

import numpy as np
import pandas as pd

from dikbench.metrics import METRICS, OUTCOME_NUMBERS, OUTCOME_TEXTS
from dikbench.results.columns import CONTROL_RATES_HZ, KEYS, SEES, SELECTORS, TIMES
from dikbench.results.selected import selected_columns, with_selected

Values = Mapping[str, Any]

DONE: Final[Values] = {
    **dict.fromkeys(OUTCOME_TEXTS, ""),
    "outcome": "success",
    "off_path_by": "position",
    "feasible": "time",
    "situation": "free space",
    "robot": "ur5",
    **dict.fromkeys(OUTCOME_NUMBERS, float("nan")),
    "outcome_step": -1.0,
    "chatters": 0.0,
    "judged_by_path": 1.0,
    "holds": 0.0,
    "path_extent_m": 0.5,
    "tolerance_m": 0.005,
    "speed_need": 0.5,
}
"""The outcome of a trial in free space that did its job."""

FAULTLESS: Final[Values] = {
    "status": "ok",
    "message": "",
    "steps": 100,
    **{name: 0.0 for name in METRICS},
    **DONE,
    "progress_mean": 1.0,
    "progress_min": 1.0,
    "path_done_share": 1.0,
    "slow_down": 1.0,
    "velocity_peak_ratio": 0.5,
    "claimed_share": float("nan"),
    "verified_share": float("nan"),
    "disagreed_share": float("nan"),
    **dict.fromkeys(SEES, float("nan")),
    "asked_alone_steps": float("nan"),
    "wall_time_s": 0.1,
    "control_time_s": 0.05,
    "environment": "e",
    "run": 1,
    **dict.fromkeys(TIMES, float("nan")),
    "timing_stability": None,
}
"""A trial of a formulation without a solver, without a fault and without times."""


def make_rows(
    formulations: Mapping[str | tuple[str, str], Values],
    scenarios: Sequence[str] = ("reach",),
    seeds: Sequence[int] = (0,),
    plant: str = "ideal",
    reference: str = "time",
) -> pd.DataFrame:
    """Make a row per formulation, scenario and seed, as a report reads them.

    Args:
        formulations: maps a formulation, or formulation and solver, to what differs from a
            faultless trial; a value may be a list, with an entry per scenario.
        scenarios: on which each runs.
        seeds: of each scenario.
        plant: of every trial.
        reference: of every trial.
    """
    rows: list[dict[str, Any]] = []
    for contender, values in formulations.items():
        formulation, solver = contender if isinstance(contender, tuple) else (contender, "none")
        for number, scenario in enumerate(scenarios):
            of_scenario = {
                name: value[number] if isinstance(value, list) else value
                for name, value in values.items()
            }
            for seed in seeds:
                how = (formulation, solver, scenario, plant, reference, seed)
                keys = dict(zip(KEYS, how, strict=False))
                rows.append({"id": f"{len(rows)}", **keys, **FAULTLESS, **of_scenario})
    return with_selected(pd.DataFrame(rows))


def random_rows(
    contenders: Iterable[str | tuple[str, str]],
    scenarios: Iterable[str],
    seeds: Iterable[int] = (0,),
    plants: Iterable[str] = ("ideal",),
) -> pd.DataFrame:
    """Make a row, with every column, for each formulation (or it and its solver) and scenario.

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
    drawn: dict[str, Any] = {
        name: random.lognormal(-4.0, 1.0, len(table)) for name in (*METRICS, *TIMES)
    }
    table = table.assign(**drawn | {"timing_samples": 100, "timing_stability": "stable"})
    table["progress_mean"] = table["progress_min"] = 1.0 - table["progress_mean"].clip(upper=1.0)
    table = table.copy().assign(**DONE, **dict.fromkeys(SEES, np.nan))
    missed = {f"missed_{rate}_hz_share": 0.0 for rate in CONTROL_RATES_HZ}
    return with_selected(table.assign(**missed).copy())  # in one block


def bare_rows(**columns: Sequence[object]) -> pd.DataFrame:
    """Make rows of one scenario, a formulation each, with little more than the columns given."""
    frame = pd.DataFrame(columns).astype({"formulation": object})
    given = {
        "solver": "none", "scenario": "reach", "plant": "ideal", "reference": "time", "seed": 0,
        "status": "ok", "formulation_time_median_us": np.nan, "timing_stability": None,
    }  # fmt: skip
    for name, value in given.items():
        if name not in frame:
            frame[name] = pd.Series(value, frame.index)
    return with_selected(frame)


def write_results(folder: Path, rows: pd.DataFrame, **manifest: Any) -> Path:
    """Write rows as a committed results folder, trials.csv and manifest.json, and return it.

    Args:
        folder: where; it is made.
        rows: see `make_rows`; what was read off their selectors is not written.
        manifest: what the manifest says otherwise than that of a made-up study.
    """
    folder.mkdir(parents=True, exist_ok=True)
    read_off = [
        name
        for column, head in SELECTORS.items()
        for name in (f"{column}_{head}", *selected_columns(rows, column).values())
    ]
    rows.drop(columns=read_off, errors="ignore").to_csv(folder / "trials.csv", index=False)
    described = {
        "study": {
            "name": "made-up",
            "description": "Rows that nobody ran",
            "scenarios": list(dict.fromkeys(rows["scenario"])),
        },
        "trials": len(rows),
        "command": "dikbench run made-up",
        "libraries": {"dikbench": "0.1.0"},
        **manifest,
    }
    (folder / "manifest.json").write_text(json.dumps(described), encoding="utf-8")
    return folder
