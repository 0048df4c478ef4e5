"""Error and speed against time for the runs of one scenario."""

from __future__ import annotations

from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np
import pandas as pd

from dikbench.array import Array
from dikbench.motion import recompute
from dikbench.registry import make_scenario
from dikbench.report.style import look, save
from dikbench.run.results import ResultsFolder
from dikbench.scenario import Scenario
from dikbench.trace import Trace

LEAST = 1e-3
"""Nothing below this [mm, or share of a limit] is drawn: the axes are logarithmic."""


def draw_time_series(
    folder: ResultsFolder, rows: pd.DataFrame, scenario_name: str, target: Path
) -> str | None:
    """Draw the stored traces of one scenario on the ideal plant, one curve per law.

    Returns:
        The figure's file name, or None where no trace of the scenario is stored.
    """
    chosen = rows[
        rows["scenario"].eq(scenario_name)
        & rows["plant"].eq("ideal")
        & rows["reference"].eq("time")
    ].drop_duplicates("formulation")
    traces = {
        row.formulation: Trace.load(path)
        for row in chosen.itertuples()
        if (path := folder.trace(str(row.id))).is_file()
    }
    if not traces:
        return None
    scenario = make_scenario(scenario_name, int(chosen["seed"].iloc[0]))
    figure, (upper, lower) = plt.subplots(2, 1, figsize=(7.2, 5.2), sharex=True)
    for number, (name, trace) in enumerate(traces.items()):
        motion = recompute(trace, scenario)
        time = np.arange(trace.steps + 1) * trace.dt
        upper.plot(time, np.maximum(1e3 * motion.position_error, LEAST), label=name, **look(number))
        lower.plot(time[:-1], _speed_ratio(trace, scenario), label=name, **look(number))
    upper.set_yscale("log")
    upper.set_ylabel("position error [mm]")
    lower.set_yscale("log")
    lower.set_ylabel("largest joint speed over limit")
    lower.axhline(1.0, color="0.5", linewidth=0.8)
    lower.set_xlabel("time [s]")
    figure.legend(*upper.get_legend_handles_labels(), loc="outside right upper")
    return save(figure, target, "error_and_speed_against_time")


def _speed_ratio(trace: Trace, scenario: Scenario) -> Array:
    limit = scenario.robot.limits.velocity
    if limit is None:
        return np.full(trace.steps, np.nan)
    ratio: Array = np.maximum(limit.usage(trace.applied).max(axis=1), LEAST)
    return ratio
