"""The columns of a results table that are neither metrics nor parameters."""

from __future__ import annotations

from collections.abc import Mapping
from types import MappingProxyType
from typing import Final

KEYS: Final = (
    "formulation",
    "solver",
    "scenario",
    "plant",
    "reference",
    "seed",
    "status",
    "message",
)
CELL: Final = ["formulation", "solver", "scenario"]

RATES: Final = (100, 200, 500, 1000)
"""Control rates [Hz] whose deadlines are counted."""

TIMES: Final[Mapping[str, tuple[str, str]]] = MappingProxyType(
    {
        "kinematics_time_median_us": ("REAL", "median time of kinematics and tasks [us]"),
        "law_time_median_us": ("REAL", "median time of one call of the law with its solver [us]"),
        "law_own_time_median_us": ("REAL", "median of it outside the solver [us]"),
        "solver_core_time_median_us": ("REAL", "median of it in the library's solving call [us]"),
        "solver_wrapper_time_median_us": ("REAL", "median of it between law and library [us]"),
        "law_time_p99_us": ("REAL", "99 % quantile of the call [us]"),
        "law_time_p999_us": ("REAL", "99.9 % quantile of the call [us]"),
        "law_time_max_us": ("REAL", "longest call [us]"),
        **{
            f"missed_{rate}_hz_share": (
                "REAL",
                f"share of the steps, kinematics included, longer than a period at {rate} Hz",
            )
            for rate in RATES
        },
        "timing_samples": ("INTEGER", "number of calls timed"),
        "timing_verdict": ("TEXT", "stable, or why the times cannot be trusted"),
    }
)
"""Columns of the timing pass: type in the store, and what they say."""
