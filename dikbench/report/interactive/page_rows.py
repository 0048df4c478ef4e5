"""The rows of the page: the trials that count, with what its controls and charts ask of them."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from shlex import quote
from types import MappingProxyType
from typing import Any, Final

import numpy as np
import pandas as pd

from dikbench.errors import DikbenchError
from dikbench.metrics import Judgement, Outcome
from dikbench.plugins.building import make_formulation
from dikbench.plugins.drawing import drawn_parameters
from dikbench.plugins.finding import formulation_plugin, in_file
from dikbench.plugins.tuned import file_for, key_of, read_tuned
from dikbench.report.figures.formulation_sweeps import formulation_sweeps
from dikbench.report.selection.categories import CATEGORIES
from dikbench.report.selection.phase_grids import phase_grids
from dikbench.report.selection.rows import names_of_contenders
from dikbench.scenario.oracle import ORACLES
from dikbench.selector import Selector, parse_selector
from dikbench.statistics.success import counted, with_facts

TOLERANCES_M: Final = (0.001, 0.002, 0.005, 0.01, 0.02, 0.05)
"""The tolerances of the slider after the scenario's own."""

AT_REST: Final = "rest"
"""The reference of a target at rest, which neither waits nor moves on."""

BOTH: Final = "both"
"""The variant of what has nothing to tune, or whose defaults tuning did not better."""

SHOWN: Final[Mapping[str, tuple[str, float]]] = MappingProxyType(
    {
        "error": ("contour_error_6d_rms_m", 1e3),
        "farthest": ("contour_error_6d_max_m", 1e3),
        "slow": ("slow_down", 1.0),
        "peak": ("velocity_peak_ratio", 1.0),
    }
)
"""Of each number of a row: the column it is of, and its factor (to mm)."""


def page_rows(trials: pd.DataFrame) -> pd.DataFrame:
    """Make the rows of the page: a trial that counts in a setting each (see `counted`).

    Its columns are id, contender (the formulation, with its solver where it has several),
    formulation, solver, asked_law and asked_case (the options of `dikbench run`), interface, first
    (1 for the first solver of a formulation), variant and is_tuned (see `variant`), scenario, seed,
    family, situation, plant, reference (`AT_REST` where the target rests), robot, outcomes (see
    `_outcomes`), the numbers of `SHOWN`, deadline (see `_slowest_steps` [us]), grid, across, up
    (its place in a phase diagram), swept, value (the parameter of the formulation that is swept).
    """
    facts = with_facts(trials)
    facts = facts[~facts["formulation"].isin(ORACLES)]
    rows = pd.concat([counted(facts, setting) for setting in ("time", "path")])
    rows = rows[~rows.index.duplicated()].sort_index().reset_index(drop=True)
    if rows.empty:
        return rows
    names = names_of_contenders(rows)
    pairs = list(zip(rows["formulation"], rows["solver"], strict=True))
    variants = {text: variant(text) for text in rows["formulation"].unique()}
    first = rows.groupby("formulation", sort=False)["solver"].transform("first")
    at_rest = rows["judged_by_path"].eq(0)
    found = pd.DataFrame(
        {
            "id": rows["id"],
            "contender": [names[pair] for pair in pairs],
            "formulation": rows["formulation"],
            "solver": rows["solver"],
            "asked_law": [_options(formulation=f, solver=s) for f, s in pairs],
            "asked_case": [
                _options(scenario=scenario, seed=seed, plant=plant, reference=reference)
                for scenario, seed, plant, reference in zip(
                    *(rows[name] for name in ("scenario", "seed", "plant", "reference")),
                    strict=True,
                )
            ],
            "interface": [interface_of(solver) for solver in rows["solver"]],
            "first": rows["solver"].eq(first).astype(int),
            "variant": rows["formulation"].map(variants),
            "scenario": rows["scenario"],
            "seed": rows["seed"],
            "family": rows["scenario_family"],
            "situation": rows["situation"],
            "plant": rows["plant"],
            "reference": rows["reference"].where(~at_rest, AT_REST),
            "robot": rows["robot"].fillna(""),
            "outcomes": _outcomes(rows),
            **{
                name: pd.to_numeric(rows[column]) * factor
                for name, (column, factor) in SHOWN.items()
                if column in rows
            },
        }
    )
    found["is_tuned"] = found["variant"].isin(["tuned", BOTH]).astype(int)
    found["deadline"] = _slowest_steps(trials).reindex(pairs).to_numpy()
    return found.join(_grid_places(rows)).join(_swept(rows))


def _options(**values: Any) -> str:
    """Write options of a command for a shell, those without a value left out."""
    told = [f"--{name} {quote(str(value))}" for name, value in values.items() if value != "none"]
    return " ".join(told)


def interface_of(solver: str) -> str:
    """Return the interface of a solver's selector: cold, warm, or none."""
    if solver == "none":
        return "none"
    return str(parse_selector(solver).parameters.get("interface", "cold"))


def variant(formulation: str) -> str:
    """Say whether the parameters of a formulation are the defaults, tuned, both or neither.

    Returns:
        default, tuned, both (where there is nothing to tune, or tuning found nothing better) or
        other. What is not known here, and code in a file, which a report does not run, is default
        without parameters.
    """
    selector = parse_selector(formulation)
    untold = "other" if selector.parameters else "default"
    if in_file(selector.name):
        return untold
    try:
        tunable = drawn_parameters(formulation_plugin(selector.name), Selector(selector.name))
        switches = {k: v for k, v in selector.parameters.items() if k not in tunable}
        untuned = Selector(selector.name, switches)
        tuned = read_tuned(file_for(selector)).get(key_of(untuned))
        # Compared as they are built: 0.05 is 5e-2.
        own, default = make_formulation(selector), make_formulation(untuned)
        found = {} if tuned is None else {k: str(v) for k, v in tuned.parameters.items()}
        best = tuned and make_formulation(Selector(selector.name, {**switches, **found}))
    except DikbenchError:
        return untold
    if not tunable or own == default == best:
        return BOTH
    return "tuned" if own == best else "default" if own == default else "other"


def _outcomes(rows: pd.DataFrame) -> list[str]:
    """Write the outcomes of each row as digits: places in `CATEGORIES`.

    The first one is at the scenario's own tolerance, the next at `TOLERANCES_M`; then again the
    same where limits may be broken (obstacles may not).
    """
    places = {outcome: str(k) for k, c in enumerate(CATEGORIES) for outcome in c.outcomes}
    found, records = [], list[Any](rows.to_dict("records"))
    for row in records:
        if row["outcome"] == Outcome.DOES_NOT_SEE:
            found.append(places[Outcome.DOES_NOT_SEE] * 2 * (1 + len(TOLERANCES_M)))
            continue
        kept = Judgement.of_row(row)
        broken = kept.before is not None and kept.before.outcome is Outcome.LIMIT_BROKEN
        may_break = replace(kept, before=None) if broken else kept
        tolerances = (row["tolerance_m"], *TOLERANCES_M)
        found.append(
            "".join(places[each.at(t).outcome] for each in (kept, may_break) for t in tolerances)
        )
    return found


def _slowest_steps(trials: pd.DataFrame) -> pd.Series:
    """Return the time of a step [us] of each formulation and solver, by which it is done in time.

    It is the 99th percentile of its own, and the median of the kinematics (of a peer, which has its
    own, 0), the largest of the timed scenarios.
    """
    own, kinematics = (
        pd.to_numeric(trials[f"{name}_us"])
        for name in ("formulation_time_p99", "kinematics_time_median")
    )
    found: pd.Series = (
        (own + kinematics.fillna(0.0)).groupby([trials["formulation"], trials["solver"]]).max()
    )
    return found


def _grid_places(rows: pd.DataFrame) -> pd.DataFrame:
    """Return the phase diagram of each row, and its place in it (see `phase_grids`)."""
    places: dict[str, tuple[str, float, float]] = {}
    for grid in phase_grids(rows):
        named = f"{grid.family}[{grid.others}]: {grid.up} over {grid.across}"
        for scenario, x, y in zip(
            grid.rows["scenario"], grid.rows["across"], grid.rows["up"], strict=True
        ):
            places[scenario] = (named, x, y)
    found = [places.get(scenario, ("", np.nan, np.nan)) for scenario in rows["scenario"]]
    return pd.DataFrame(found, columns=["grid", "across", "up"], index=rows.index)


def _swept(rows: pd.DataFrame) -> pd.DataFrame:
    """Return the parameter of each row's formulation that is swept, and its value."""
    values: dict[str, tuple[str, float]] = {}
    for sweep in formulation_sweeps(rows):
        others = f"[{sweep.others}]" if sweep.others else ""
        named = f"{sweep.formulation}{others}: {sweep.parameter}"
        for formulation, value in zip(sweep.rows["formulation"], sweep.rows["value"], strict=True):
            values[formulation] = (named, value)
    return pd.DataFrame(
        [values.get(text, ("", np.nan)) for text in rows["formulation"]],
        columns=["swept", "value"],
        index=rows.index,
    )


def as_columns(rows: pd.DataFrame) -> dict[str, Any]:
    """Return the columns for JSON: texts by their place in a list, numbers in 4 digits."""
    found: dict[str, Any] = {}
    for name, column in rows.items():
        if pd.api.types.is_integer_dtype(column):
            found[str(name)] = {"values": column.tolist()}
        elif pd.api.types.is_numeric_dtype(column):
            found[str(name)] = {
                "values": [float(f"{x:.4g}") if np.isfinite(x) else None for x in column]
            }
        else:
            codes, words = pd.factorize(column)
            found[str(name)] = {"words": list(words), "values": codes.tolist()}
    return found
