"""The columns of a table of results that are neither metrics nor parameters of selectors."""

from __future__ import annotations

from collections.abc import Mapping
from types import MappingProxyType
from typing import Final

from dikbench.metrics import OUTCOME_NUMBERS, OUTCOME_TEXTS

TRIAL: Final = ["formulation", "solver", "scenario", "plant", "reference", "seed"]
"""Columns that identify the trial of a row."""

KEYS: Final = (*TRIAL, "status", "message")
SEES: Final[Mapping[str, str]] = MappingProxyType(
    {
        "sees_constraints": "whether the formulation sees the rows G v <= h of torques and "
        "distances (1, 0; empty where there are none)",
        "sees_lower_tasks": "whether the formulation sees every task below the first priority "
        "(1, 0; empty where there is none)",
        "sees_weights": "whether the formulation sees the weights of tasks and rows (1, 0; empty "
        "where all of the first priority are 1 and those of each lower one equal)",
    }
)
"""Columns of what a formulation sees of a scenario's problems, and what they say."""

ASKED: Final[Mapping[str, str]] = MappingProxyType(
    {
        "asked_alone_steps": "control steps at which the formulation was asked for this trial "
        "alone; empty where the trial did not run in lockstep"
    }
)
"""Columns of how a trial was run, and what they say."""

TIMED: Final = ["formulation", "solver", "scenario"]
"""Columns that identify the cell of a row of times."""

SELECTORS: Final = MappingProxyType(
    {"formulation": "name", "solver": "name", "scenario": "family", "plant": "name"}
)
"""Columns of selectors, with the name of the part before the brackets."""

CONTROL_RATES_HZ: Final = (100, 200, 500, 1000)
"""Control rates whose missed deadlines are counted."""

TIMES: Final[Mapping[str, tuple[str, str]]] = MappingProxyType(
    {
        "kinematics_time_median_us": ("REAL", "median time of kinematics and tasks [us]"),
        "formulation_time_median_us": ("REAL", "median time of a call with its solver [us]"),
        "formulation_own_time_median_us": ("REAL", "median of it outside the solver [us]"),
        "solver_core_time_median_us": ("REAL", "median of it in the library's solving call [us]"),
        "solver_wrapper_time_median_us": ("REAL", "median of it in the solver's wrapper [us]"),
        "formulation_time_p99_us": ("REAL", "99 % quantile of the call [us]"),
        "formulation_time_p999_us": ("REAL", "99.9 % quantile of the call [us]"),
        "formulation_time_max_us": ("REAL", "longest call [us]"),
        **{
            f"missed_{rate}_hz_share": (
                "REAL",
                f"share of the steps, kinematics included, longer than a period at {rate} Hz",
            )
            for rate in CONTROL_RATES_HZ
        },
        "timing_samples": ("INTEGER", "number of calls timed"),
        "timing_stability": ("TEXT", "stable, or why the times cannot be trusted"),
    }
)
"""Columns of the timing pass: type in the store, and definition."""

RENAMED_TIMES: Final[Mapping[str, str]] = MappingProxyType(
    {
        **{
            name.replace("formulation", "law", 1): name
            for name in TIMES
            if name.startswith("formulation_")
        },
        "timing_verdict": "timing_stability",
    }
)
"""Columns of times of older results, and their names today."""

RENAMED_METRICS: Final[Mapping[str, str]] = MappingProxyType(
    {"off_course_max_rad": "direction_error_max_rad"}
)
"""Metrics of older results, and their names today."""

RENAMED: Final[Mapping[str, str]] = MappingProxyType({**RENAMED_TIMES, **RENAMED_METRICS})
"""Columns of older results, and their names today."""

REDEFINED: Final = ("path_done_share", "lag_max_s", "lag_final_s")
"""Metrics that version 0.1 took of the position alone: what it stored of them is not read."""

DESCRIBED: Final = MappingProxyType(
    {
        "id": ("", "hash of everything that the trial consists of"),
        "formulation": ("", "selector of the formulation"),
        "solver": ("", "selector of its solver; none for a formulation that needs none"),
        "scenario": ("", "selector of the scenario"),
        "plant": ("", "selector of the plant"),
        "reference": ("", "what advanced the reference: time or path"),
        "seed": ("", "seed of the scenario"),
        "status": ("", "how the trial ended"),
        "message": ("", "why, where it did not end well"),
        "steps": ("", "number of control steps"),
        **{name: ("", text) for name, text in OUTCOME_TEXTS.items()},
        **OUTCOME_NUMBERS,
        **{name: ("", text) for name, text in SEES.items()},
        **{name: ("", text) for name, text in ASKED.items()},
        "wall_time_s": ("s", "time of the trial in its worker"),
        "control_time_s": ("s", "of it in kinematics, formulation and solver"),
        "environment": ("", "name of the worker's environment in the store"),
        "run": ("", "number of the run that the row is of"),
        **{name: ("us" if name.endswith("_us") else "", text) for name, (_, text) in TIMES.items()},
    }
)
"""Unit and definition of the columns of trials that are not metrics."""
