"""How many drawn scenarios were rejected, by family and robot: they bias what is left."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any, Final

import numpy as np
import pandas as pd

from dikbench.selector import parse_selector
from dikbench.study.instances import Attempt

REASONS: Final = 3
"""Most reasons of a row, those met most often first."""


def instances_table(attempts: Sequence[Attempt]) -> pd.DataFrame:
    """Count the attempts that were accepted and rejected, a row per family and robot.

    The columns `<parameter>_accepted` and `<parameter>_rejected` are the medians of each number
    that was drawn.
    """
    groups: dict[tuple[str, str], list[Attempt]] = {}
    for each in attempts:
        robot = parse_selector(each.scenario).parameters.get("robot", "")
        groups.setdefault((each.given, robot), []).append(each)
    return pd.DataFrame([_row(*key, found) for key, found in sorted(groups.items())])


def _row(given: str, robot: str, attempts: Sequence[Attempt]) -> dict[str, Any]:
    rejected = [each for each in attempts if each.rejected]
    reasons = pd.Series([_reason(each) for each in rejected], dtype=str).value_counts()
    row: dict[str, Any] = {
        "family": given,
        "robot": robot,
        "accepted": len(attempts) - len(rejected),
        "rejected": len(rejected),
        "accepted_share": round(1 - len(rejected) / len(attempts), 4),
        "first_reasons": "; ".join(f"{n} x {text}" for text, n in reasons[:REASONS].items()),
    }
    values: dict[str, list[float]] = {}
    for each in attempts:
        for name, text in parse_selector(each.scenario).parameters.items():
            column = f"{name}_{'rejected' if each.rejected else 'accepted'}"
            try:
                values.setdefault(column, []).append(float(text))
            except ValueError:  # a choice
                continue
    return row | {name: float(f"{np.median(found):.4g}") for name, found in values.items() if found}


def _reason(attempt: Attempt) -> str:
    """Return why a scenario was rejected, without its selector and the numbers that differ."""
    text = attempt.rejected.replace(attempt.scenario, "").replace("certificate of '' failed: ", "")
    return text.removeprefix("scenario ").lstrip(": ").partition(" = ")[0]


def write_instances(attempts: Sequence[Attempt], folder: Path) -> None:
    """Write the table to `instances.csv` in a folder, where something was drawn."""
    if attempts:
        instances_table(attempts).to_csv(folder / "instances.csv", index=False)


def in_a_sentence(table: pd.DataFrame) -> str:
    """Say how many drawn scenarios were rejected, and of what family most, by share."""
    sums = table.groupby("family", sort=False)[["accepted", "rejected"]].sum()
    accepted, rejected = int(sums["accepted"].sum()), int(sums["rejected"].sum())
    share = sums["accepted"] / sums.sum(axis=1)
    least = f"; the smallest accepted share is that of {share.idxmin()}, {share.min():.0%}"
    return (
        f"{accepted} instances were drawn and {rejected} draws rejected, since they cannot be "
        f"built or their certificate fails, which biases what is left{least if rejected else ''} "
        "(tables/instances.csv)."
    )
