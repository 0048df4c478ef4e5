"""The columns of a table of results that are neither metrics nor parameters of selectors."""

from __future__ import annotations

from collections.abc import Mapping
from types import MappingProxyType
from typing import Final

TRIAL: Final = ["formulation", "solver", "scenario", "plant", "reference", "seed"]
"""What says which trial a row is of, whatever the versions."""

KEYS: Final = (*TRIAL, "status", "message")
SEES: Final[Mapping[str, str]] = MappingProxyType(
    {
        "sees_constraints": "whether the formulation sees the rows G v <= h of torques and "
        "distances (1, 0; empty where there are none)",
        "sees_lower_tasks": "whether the formulation sees every task below the first priority "
        "(1, 0; empty where there is none)",
    }
)
"""Columns of what a formulation sees of a scenario's problems, and what they say."""

TIMED: Final = ["formulation", "solver", "scenario"]
"""What says which times a row is of."""

SELECTORS: Final = MappingProxyType(
    {"formulation": "name", "solver": "name", "scenario": "family", "plant": "name"}
)
"""Columns that hold selectors, and what the part before the brackets is called."""

RATES: Final = (100, 200, 500, 1000)
"""Control rates [Hz] whose deadlines are counted."""

TIMES: Final[Mapping[str, tuple[str, str]]] = MappingProxyType(
    {
        "kinematics_time_median_us": ("REAL", "median time of kinematics and tasks [us]"),
        "formulation_time_median_us": (
            "REAL",
            "median time of one call of the formulation with its solver [us]",
        ),
        "formulation_own_time_median_us": ("REAL", "median of it outside the solver [us]"),
        "solver_core_time_median_us": ("REAL", "median of it in the library's solving call [us]"),
        "solver_wrapper_time_median_us": (
            "REAL",
            "median of it between formulation and library [us]",
        ),
        "formulation_time_p99_us": ("REAL", "99 % quantile of the call [us]"),
        "formulation_time_p999_us": ("REAL", "99.9 % quantile of the call [us]"),
        "formulation_time_max_us": ("REAL", "longest call [us]"),
        **{
            f"missed_{rate}_hz_share": (
                "REAL",
                f"share of the steps, kinematics included, longer than a period at {rate} Hz",
            )
            for rate in RATES
        },
        "timing_samples": ("INTEGER", "number of calls timed"),
        "timing_stability": ("TEXT", "stable, or why the times cannot be trusted"),
    }
)
"""Columns of the timing pass: type in the store, and what they say."""

RENAMED: Final[Mapping[str, str]] = MappingProxyType(
    {
        **{
            name.replace("formulation", "law", 1): name
            for name in TIMES
            if name.startswith("formulation_")
        },
        "timing_verdict": "timing_stability",
    }
)
"""Columns of older results, and what they are called today."""

DESCRIBED: Final = MappingProxyType(
    {
        "id": ("", "hash of everything that the trial is made of"),
        "formulation": ("", "selector of the formulation"),
        "solver": ("", "selector of its solver; none for a formulation that needs none"),
        "scenario": ("", "selector of the scenario"),
        "plant": ("", "selector of the plant"),
        "reference": ("", "what moved the reference on: time or path"),
        "seed": ("", "seed of the scenario"),
        "status": ("", "how the trial ended"),
        "message": ("", "why, where it did not end well"),
        "steps": ("", "number of control steps"),
        **{name: ("", text) for name, text in SEES.items()},
        "wall_time_s": ("s", "time of the trial in its worker"),
        "control_time_s": ("s", "of it in kinematics, formulation and solver"),
        "environment": ("", "name of the worker's environment in the store"),
        "run": ("", "number of the run that the row is of"),
        **{name: ("us" if name.endswith("_us") else "", text) for name, (_, text) in TIMES.items()},
    }
)
"""Unit and definition of the columns of trials that are no metrics."""
