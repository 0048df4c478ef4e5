"""The control steps of trials as a tidy data frame, read from their traces."""

from __future__ import annotations

from collections.abc import Iterable
from types import MappingProxyType
from typing import Any, Final

import numpy as np
import pandas as pd

from dikbench.errors import DikbenchError
from dikbench.results.folder import ResultsFolder
from dikbench.simulation.status import STEP_STATUSES
from dikbench.simulation.trace import Trace

JOINT_UNIT: Final = "rad"
"""Unit of revolute joints; prismatic ones are in m."""

STEP_COLUMNS: Final = MappingProxyType(
    {
        "id": ("", "the trial"),
        "step": ("", "number of the control step, from 0"),
        "time_s": ("s", "time at the start of the step"),
        "tau_s": ("s", "nominal time on the reference"),
        "status": ("", "how the step ended"),
        "relaxed": ("", "joints whose acceleration bound was given up"),
        "claimed": ("", "whether the solver claimed to solve the step's programs; -1: none"),
        "verified": ("", "whether the recheck confirmed it; -1: none"),
        "primal": ("", "largest primal residual"),
        "dual": ("", "largest dual residual"),
        "gap": ("", "largest duality gap"),
        "distance_rad_s": ("rad/s", "largest distance from the optimum"),
        "q": (JOINT_UNIT, "configuration before the step, a column per coordinate"),
        "wanted": ("m/s, rad/s", "desired twist of the task frame, a column per tracked row"),
        "commanded": (f"{JOINT_UNIT}/s", "velocity of the formulation, a column per joint"),
        "applied": (f"{JOINT_UNIT}/s", "velocity that the plant applied, a column per joint"),
    }
)
"""Unit and definition of the columns of the control steps; the last four stand for several."""

PER_COORDINATE: Final = ("q", "wanted", "commanded", "applied")


def steps_of(folder: ResultsFolder, ids: Iterable[str]) -> pd.DataFrame:
    """Read the control steps of those trials that have a trace, a row per trial and step.

    Raises:
        DikbenchError: if none has a trace.
    """
    frames = [
        _steps(name, Trace.load(path)) for name in ids if (path := folder.trace(name)).is_file()
    ]
    if not frames:
        raise DikbenchError(f"no traces of these trials are stored in {folder.traces}")
    steps = pd.concat(frames, ignore_index=True)
    found = {name: STEP_COLUMNS[name.rstrip("0123456789").rstrip("_")] for name in map(str, steps)}
    steps.attrs["units"] = {name: unit for name, (unit, _) in found.items()}
    steps.attrs["definitions"] = {name: text for name, (_, text) in found.items()}
    return steps


def _steps(name: str, trace: Trace) -> pd.DataFrame:
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
