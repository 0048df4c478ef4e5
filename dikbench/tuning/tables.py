"""The tables of tuning: what was tried, and what it brings."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np
import pandas as pd

from dikbench.errors import DikbenchError
from dikbench.tuning.candidates import at_edge
from dikbench.tuning.tuning import Tuning


def summary(tunings: Sequence[Tuning]) -> pd.DataFrame:
    """Make a row per formulation: mean success [%] on both splits, and what tuning brings.

    `train_second_half_gain` is what the second half of the budget brought, `at_edge` names
    parameters whose tuned value is at an end of its range. Without a test run its columns lack.
    """
    rows = []
    for each in tunings:
        scored, tested = each.scores, each.gain
        row = {
            "formulation": str(scored.default),
            "tuned": str(scored.best),
            "at_edge": " ".join(at_edge(scored.default, scored.best)),
            "train_default": scored.success[0],
            "train_tuned": scored.best_success,
            "train_worst": scored.success[1:].min(),
            "train_second_half_gain": scored.best_success - scored.half_success,
            "train_cases": scored.cases,
        }
        if tested is not None:
            row |= {
                "test_default": tested.default,
                "test_tuned": tested.tuned,
                "test_worst": tested.worst,
                "test_gain": tested.difference,
                "test_gain_lower": tested.lower,
                "test_gain_upper": tested.upper,
                "test_cases": tested.cases,
            }
        rows.append(row)
    table = pd.DataFrame(rows)
    rates = list(table.select_dtypes("float").columns)
    table[rates] = (100 * table[rates]).round(2)
    return table


def tried(tunings: Sequence[Tuning]) -> pd.DataFrame:
    """Make a row per candidate, number 0 being the default: mean success [%] on the train split.

    `distance_mm` is the geometric mean of the largest distance from the path.
    """
    parts = [
        pd.DataFrame(
            {
                "formulation": str(scored.default),
                "number": range(1 + len(scored.candidates)),
                "candidate": [str(scored.default), *map(str, scored.candidates)],
                "success": (100 * scored.success).round(2),
                "distance_mm": np.exp(scored.log_distance).round(6) * 1e3,
                "tuned": [each == scored.best for each in (scored.default, *scored.candidates)],
            }
        )
        for scored in (each.scores for each in tunings)
    ]
    return pd.concat(parts, ignore_index=True)


def write_tables(tunings: Sequence[Tuning], out: Path) -> None:
    """Write `tuning.csv`, a row per formulation, and `candidates.csv`, one per candidate.

    Raises:
        DikbenchError: if a file cannot be written.
    """
    try:
        summary(tunings).to_csv(out / "tuning.csv", index=False)
        tried(tunings).to_csv(out / "candidates.csv", index=False)
    except OSError as error:
        raise DikbenchError(f"folder {out}: {error.strerror or error}") from None


def in_words(tuning: Tuning) -> str:
    """Say in a line what came of one formulation."""
    scored = tuning.scores
    text = (
        f"{scored.default}: {100 * scored.success[0]:.1f} % at the default, "
        f"{100 * scored.success[1:].min():.1f} to {100 * scored.success[1:].max():.1f} % at the "
        f"{len(scored.candidates)} candidates"
    )
    best = "the default stays" if scored.best == scored.default else f"best is {scored.best}"
    text += f"; {best} ({scored.cases} cases of the train split)"
    edge = at_edge(scored.default, scored.best)
    return text + (f"; {', '.join(edge)} at an end of its range" if edge else "")


def gain_in_words(tuning: Tuning) -> str:
    """Say in a line what tuning brings on the test split; what is not told apart is said so."""
    scored, found = tuning.scores, tuning.gain
    if found is None:
        return ""
    apart = "" if found.lower > 0 or found.upper < 0 else ", not told apart"
    change = (
        "its default is kept"
        if scored.best == scored.default
        else f"{100 * found.difference:+.1f} points ({100 * found.lower:+.1f} to "
        f"{100 * found.upper:+.1f}){apart}"
    )
    return (
        f"{scored.default}: {100 * found.default:.1f} % at the default, {100 * found.tuned:.1f} % "
        f"tuned, {100 * found.worst:.1f} % at the worst candidate; {change} "
        f"({found.cases} cases of the test split)"
    )
