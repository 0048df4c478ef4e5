"""Results as tidy data frames, for notebooks."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from pathlib import Path
from types import MappingProxyType
from typing import Any, Final

import numpy as np
import pandas as pd

from dikbench.errors import DikbenchError
from dikbench.metrics import METRICS
from dikbench.results.columns import TIMES
from dikbench.results.folder import ResultsFolder
from dikbench.selector import parse_selector
from dikbench.simulation.status import STEP_STATUSES
from dikbench.simulation.trace import Trace

SELECTED: Final = MappingProxyType(
    {"formulation": "name", "solver": "name", "scenario": "family", "plant": "name"}
)
"""Columns that hold selectors, and how the part before the brackets is called."""

TRIAL_COLUMNS: Final = MappingProxyType(
    {
        "id": ("", "hash of everything that the trial is made of"),
        "formulation": ("", "selector of the law, as it was given"),
        "solver": ("", "selector of its solver; none for a law that needs none"),
        "scenario": ("", "selector of the scenario"),
        "plant": ("", "selector of the plant"),
        "reference": ("", "what moved the reference on: time or path"),
        "seed": ("", "seed of the scenario"),
        "status": ("", "how the trial ended"),
        "message": ("", "why, where it did not end well"),
        "steps": ("", "number of control steps"),
        "wall_time_s": ("s", "time of the trial in its worker"),
        "control_time_s": ("s", "of it in kinematics, law and solver"),
        "environment": ("", "name of the worker's environment in the store"),
        "run": ("", "number of the run that the row is of"),
    }
)
"""Unit and definition of what is neither a metric nor a time of the timing pass."""

JOINT_UNIT: Final = "rad"
"""Of revolute joints; coordinates of prismatic ones are in m."""

STEP_COLUMNS: Final = MappingProxyType(
    {
        "id": ("", "the trial"),
        "step": ("", "number of the control step, from 0"),
        "time_s": ("s", "when the step begins"),
        "tau_s": ("s", "nominal time on the reference"),
        "status": ("", "how the step ended"),
        "relaxed": ("", "joints whose acceleration bound was given up"),
        "claimed": ("", "whether the solver said that it solved the step's programs; -1: none"),
        "verified": ("", "whether the recheck says so; -1: none"),
        "primal": ("", "largest primal residual"),
        "dual": ("", "largest dual residual"),
        "gap": ("", "largest duality gap"),
        "distance_rad_s": ("rad/s", "largest distance from the optimum"),
        "q": (JOINT_UNIT, "configuration before the step, a column per coordinate"),
        "wanted": ("m/s, rad/s", "desired twist of the task frame, a column per tracked row"),
        "commanded": (f"{JOINT_UNIT}/s", "velocity that the law commanded, a column per joint"),
        "applied": (f"{JOINT_UNIT}/s", "velocity that the plant made of it, a column per joint"),
    }
)
"""Unit and definition of the columns of the control steps; the last four stand for several."""

PER_COORDINATE: Final = ("q", "wanted", "commanded", "applied")


@dataclass(frozen=True, eq=False)
class Results:
    """What a results folder holds.

    Attributes:
        folder: the folder.
        manifest: how the run was made: study, versions, machine, command.
        trials: a row per trial: the columns of trials.csv, and for each selector its name and its
            parameters as columns of their own (`formulation_name`, `formulation_damping`,
            `scenario_family`, `scenario_miss`, ...), missing where a selector does not name them.
            `attrs["units"]` and `attrs["definitions"]` say what a column is in.
    """

    folder: Path
    manifest: dict[str, Any]
    trials: pd.DataFrame

    def steps(self, trials: pd.DataFrame | Iterable[str] | None = None) -> pd.DataFrame:
        """A row per trial and control step, read from the traces when asked for.

        Args:
            trials: rows of `trials`, or ids of trials; default: all that have a trace.

        Returns:
            Columns `id`, `step`, `time_s`, `tau_s`, `status`, ..., and `q_0`, `applied_0`, ... per
            coordinate, NaN where a robot has fewer; units and definitions as in `trials`.

        Raises:
            DikbenchError: if no traces are stored, or an id is unknown.
        """
        folder = ResultsFolder(self.folder)
        if trials is None:
            trials = self.trials
        ids = list(trials["id"] if isinstance(trials, pd.DataFrame) else trials)
        unknown = set(ids) - set(self.trials["id"])
        if unknown:
            raise DikbenchError(
                f"no trial of {self.folder} has the id {min(unknown)!r}; valid: those in trials.id"
            )
        frames = [
            _steps_of(name, Trace.load(path))
            for name in ids
            if (path := folder.trace(name)).is_file()
        ]
        if not frames:
            raise DikbenchError(f"no traces of these trials are stored in {folder.traces}")
        steps = pd.concat(frames, ignore_index=True)
        known_of = {
            name: STEP_COLUMNS[name.rstrip("0123456789").rstrip("_")] for name in map(str, steps)
        }
        return _described(steps, known_of)


def load_results(folder: str | Path) -> Results:
    """Load a results folder, with its store or without it, as it is committed.

    Args:
        folder: what `dikbench run` wrote.

    Raises:
        DikbenchError: if the folder holds no results.
    """
    path = Path(folder)
    trials, manifest = ResultsFolder(path).read()
    known = dict(_KNOWN)
    for column, head in SELECTED.items():
        parameters = _parameters(trials[column], column, head)
        known |= {
            name: ("", f"{name.removeprefix(f'{column}_')} in the selector of the {column}")
            for name in map(str, parameters)
        }
        trials = trials.join(parameters)
    return Results(path, manifest, _described(trials, known))


_KNOWN: Final = {
    **TRIAL_COLUMNS,
    **{metric.name: (metric.unit, metric.definition) for metric in METRICS.values()},
    **{name: ("us" if name.endswith("_us") else "", text) for name, (_, text) in TIMES.items()},
}


def _parameters(selectors: pd.Series, column: str, head: str) -> pd.DataFrame:
    """The parts of selectors, a column each; numbers where all of its values are numbers."""
    parsed = {text: parse_selector(text) for text in selectors.unique()}
    table = pd.DataFrame(
        [{head: selector.name, **selector.parameters} for selector in parsed.values()],
        index=pd.Index(parsed),
    )
    for name in table.columns[1:]:
        try:
            table[name] = pd.to_numeric(table[name])
        except ValueError:
            continue
    return table.add_prefix(f"{column}_").loc[selectors].set_axis(selectors.index)


def _steps_of(name: str, trace: Trace) -> pd.DataFrame:
    n = trace.steps
    columns: dict[str, Any] = {
        "id": name,
        "step": np.arange(n),
        "time_s": trace.dt * np.arange(n),
        "tau_s": trace.tau[:n],
        "status": np.array([status.value for status in STEP_STATUSES])[trace.status],
        "distance_rad_s": trace.distance,
        **{key: getattr(trace, key) for key in ("relaxed", "claimed", "verified")},
        **{key: getattr(trace, key) for key in ("primal", "dual", "gap")},
    }
    for key in PER_COORDINATE:
        for number, values in enumerate(getattr(trace, key)[:n].T):
            columns[f"{key}_{number}"] = values
    return pd.DataFrame(columns)


def _described(frame: pd.DataFrame, known: Mapping[str, tuple[str, str]]) -> pd.DataFrame:
    """The frame with units and definitions of its columns; empty where this version knows none."""
    found = {name: known.get(name, ("", "")) for name in map(str, frame)}
    frame.attrs["units"] = {name: unit for name, (unit, _) in found.items()}
    frame.attrs["definitions"] = {name: text for name, (_, text) in found.items()}
    return frame
