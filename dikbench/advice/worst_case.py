"""The worst case that a search found: run again, with the commands that run and replay it."""

from __future__ import annotations

import shlex
from collections import Counter
from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import msgspec
import pandas as pd

from dikbench.advice.worst import Search, Tried
from dikbench.errors import DikbenchError
from dikbench.run.in_workers import RunSettings
from dikbench.run.runner import run_study
from dikbench.study.selection import Selection, select
from dikbench.study.study import DEFAULT_STUDY, Study, folder_of, load_study
from dikbench.study.trial import NO_SOLVER

NOT_COMPARED = ("message", "described", "wall_time_s", "control_time_s")
"""Columns that say when and where a trial ran, or that the store writes in its own way."""


@dataclass(frozen=True)
class WorstCase:
    """A worst case in a results folder of its own, with traces.

    Attributes:
        folder: where its trials are.
        command: what runs them.
        ids: of the trials of the contenders.
        same: whether every number is that of the search, to the bit.
    """

    folder: Path
    command: tuple[str, ...]
    ids: tuple[str, ...]
    same: bool


def keep_worst(search: Search, solver: str, out: Path | None, settings: RunSettings) -> WorstCase:
    """Run the worst case of a search into a results folder, and write what was tried beside it.

    Args:
        search: the search.
        solver: the one that was named for the contenders; empty: none was.
        out: the folder; default: that of `dikbench run` with the same options.
        settings: how trials are run.

    Raises:
        DikbenchError: if the folder cannot be written, or holds another study.
    """
    case = search.worst
    study, command = _study(search, case, solver, out)
    folder = Path("runs") / folder_of(study) if out is None else out
    untimed = msgspec.structs.replace(study, timing=None)
    made = run_study(untimed, folder, replace(settings, traces="all"), shlex.join(command))
    with made.open_store() as store:
        stored = {str(row["formulation"]): row for _, row in store.planned().iterrows()}
    rows = [stored[str(each.formulation)] for each in search.contenders]
    same = all(_equal(row, kept) for row, kept in zip(case.rows, rows, strict=True))
    try:
        tried(search).to_csv(folder / "search.csv", index=False)
    except OSError as error:
        raise DikbenchError(f"folder {folder}: {error.strerror or error}") from None
    return WorstCase(folder, command, tuple(str(row["id"]) for row in rows), same)


def _study(
    search: Search, case: Tried, solver: str, out: Path | None
) -> tuple[Study, tuple[str, ...]]:
    """Return the study of a case, and the command that runs it."""
    row, contenders = case.rows[0], search.contenders
    needed = any(each.solver != NO_SOLVER for each in contenders)
    selection = Selection(
        formulations=tuple(str(each.formulation) for each in contenders),
        scenarios=(str(case.scenario),),
        solvers=(solver,) if solver and needed else (),
        seeds=(case.seed,),
        plants=(row["plant"],),
        references=(row["reference"],),
    )
    options = [
        *(("--formulation", text) for text in selection.formulations),
        *(("--solver", text) for text in selection.solvers),
        ("--scenario", str(case.scenario)),
        ("--seed", str(case.seed)),
        ("--plant", row["plant"]),
        ("--reference", row["reference"]),
        *([("--out", str(out))] if out is not None else []),
    ]
    command = ("dikbench", "run", *(part for option in options for part in option))
    return select(load_study(DEFAULT_STUDY), selection, named=False), command


def _equal(row: Mapping[str, Any], kept: pd.Series) -> bool:
    """Say whether a row and what the store keeps of it are equal to the bit."""
    columns = [name for name in row if name in kept.index and name not in NOT_COMPARED]
    return all(
        row[name] == kept[name] or (pd.isna(row[name]) and pd.isna(kept[name])) for name in columns
    )


def tried(search: Search) -> pd.DataFrame:
    """Make a row per case of a search and contender, in the order in which they were tried."""
    return pd.DataFrame(
        {
            "number": number,
            "scenario": str(each.scenario),
            "seed": each.seed,
            "formulation": str(contender.formulation),
            "solver": str(contender.solver),
            "counts": None not in each.badness,
            "outcome": row.get("outcome", ""),
            "distance_m": float("nan") if bad is None else bad.distance,
            "value": each.value,
            "message": row["message"],
        }
        for number, each in enumerate(search.tried)
        for contender, row, bad in zip(search.contenders, each.rows, each.badness, strict=True)
    )


def in_words(search: Search) -> list[str]:
    """Say what came of a search, in lines."""
    case, counted = search.worst, search.counted
    first, *others = search.contenders
    left = len(search.tried) - len(counted)
    against = f" against {others[0]}" if others else ""
    lines = [
        f"{first}{against}: {len(search.tried)} cases tried, {len(counted)} count"
        + (
            f"; {left} do not: rejected by their certificate, refused, or nothing is known that "
            "can do them"
            if left
            else ""
        )
    ]
    outcomes = Counter(str(each.rows[0]["outcome"]) for each in counted)
    shares = ", ".join(f"{outcome} {number}" for outcome, number in outcomes.most_common())
    lines.append(
        f"outcomes of {first} where it was looked for: {shares} (no rate: cases are sought)"
    )
    lines.append(f"the worst case: {case.scenario}, seed {case.seed}")
    for each, row, bad in zip(search.contenders, case.rows, case.badness, strict=True):
        assert bad is not None
        why = _decided(row)
        lines.append(f"  {each}: {row['outcome']}{why}, {_distance(bad.distance)}")
    return lines


def _decided(row: Mapping[str, Any]) -> str:
    """Say what decided the outcome of a row."""
    reason, figure = row.get("outcome_reason"), row.get("outcome_figure")
    if not reason or figure is None or figure != figure:
        return f" ({row['message']})" if row["message"] else ""
    peak = row.get("velocity_peak_ratio")
    most = f", {peak:.3g} at most" if reason == "joint speed over its limit" and peak else ""
    return f" ({reason}: {figure:.4g} at first{most})" if most else f" ({reason}: {figure:.4g})"


def _distance(distance: float) -> str:
    """Say how far from its path a motion was."""
    if distance == float("inf"):
        return "no distance from the path is defined"
    return f"{1000 * distance:.3g} mm from the path (L = 0.2 m x rad)"
