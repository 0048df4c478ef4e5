"""The runs that the page replays: joints, target and what they came to over time, in few bytes."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, Final

import numpy as np
import pandas as pd

from dikbench.arrays import Array, Indices
from dikbench.metrics import motion_of
from dikbench.plugins.built_scenarios import built
from dikbench.report.interactive.chosen_runs import chosen_runs
from dikbench.run.again import RunAgain, run_again, same_here
from dikbench.run.pool import available_cores, workers
from dikbench.run.progress_display import ProgressDisplay
from dikbench.scenario.scenario import Scenario
from dikbench.viewer.limit_use import joint_nearness
from dikbench.viewer.moving_joints import joint_coordinates
from dikbench.viewer.static_scene import StaticScene, static_scene, surroundings
from dikbench.viewer.target_poses import target_poses
from dikbench.viewer.viser_client import client_template, has_viser

INSTANTS: Final = 150
"""Of a run, at most, evenly spaced."""

STEPS_PER_UNIT: Final = 1e4
"""What is embedded is rounded to 1e-4 (rad, m, 1)."""

POSES_IN_VIEW: Final = 8
"""Configurations of each run, about, that the camera takes into view."""

LONGEST_S: Final = 600.0
"""For all runs of one robot, which ended before: no more than a guard."""


def make_replays(trials: pd.DataFrame, rows: pd.DataFrame) -> dict[str, Any]:
    """Run the chosen trials of a page again, in processes of their own, and describe them.

    Returns:
        runs: by id, the place of the case, the number of a group of runs that can be compared, and
            the series of the run (see `_run`).
        cases: of each scenario with its seed the place of its robot, its certificate and, with
            viser, what surrounds the robot and the path of the target.
        robots: the scenes (see `static_scene`), and client, viser's; both empty without viser.
    """
    seconds = trials.drop_duplicates("id").set_index("id")["control_time_s"].astype(float)
    wanted = trials[trials["id"].isin(chosen_runs(rows, seconds))]
    records: list[Any] = wanted.to_dict("records")
    # In lockstep run those of one robot and reference, whatever their formulation.
    alike: dict[tuple[str, str], list[Mapping[str, Any]]] = {}
    for row in same_here(records):
        alike.setdefault((row["robot"], row["reference"]), []).append(row)
    runs = _in_workers(list(alike.values()))
    in_view: dict[tuple[str, int], list[Array]] = {}
    for row in records:
        if row["id"] in runs:
            q = runs[row["id"]].pop("in_view")
            in_view.setdefault((row["scenario"], int(row["seed"])), []).append(q)
    cases: dict[tuple[str, int], tuple[int, dict[str, Any]]] = {}
    robots: dict[tuple[str, str], StaticScene | None] = {}
    drawn = has_viser()
    groups: dict[tuple[Any, ...], int] = {}
    for row in records:
        if row["id"] not in runs:
            continue
        key = row["scenario"], int(row["seed"])
        if key not in cases:
            scenario = built(*key)
            if isinstance(scenario, str):
                del runs[row["id"]]
                continue
            robot = scenario.robot.name, scenario.robot.frame
            if robot not in robots:
                robots[robot] = static_scene(scenario.robot) if drawn else None
            number, q = [*robots].index(robot), np.vstack(in_view[key])
            cases[key] = len(cases), _case(scenario, number, q, drawn=drawn)
        group = groups.setdefault((*key, row["plant"], row["reference"]), len(groups))
        runs[row["id"]] |= {"case": cases[key][0], "group": group}
    return {
        "runs": runs,
        "cases": [case for _, case in cases.values()],
        "robots": [
            {"data": scene.data, "joints": scene.joints} for scene in robots.values() if scene
        ],
        "client": client_template() if drawn and runs else "",
    }


def _in_workers(groups: Sequence[list[Mapping[str, Any]]]) -> dict[str, Any]:
    """Describe the runs of groups of rows; a group that ends its process has none."""
    found: dict[str, Any] = {}
    if not groups:
        return found
    count = min(available_cores(), len(groups))
    with (
        workers(count, (described_runs.__module__,)) as pool,
        ProgressDisplay(len(groups), "robots to be replayed") as display,
    ):
        futures = [pool.schedule(described_runs, args=(g,), timeout=LONGEST_S) for g in groups]
        for future in futures:
            try:
                found |= future.result()
            except Exception:  # whatever a formulation does: the page names the command instead
                continue
            finally:
                display.advance()
    return found


def described_runs(rows: list[Mapping[str, Any]]) -> dict[str, Any]:
    """Run the trials of rows again and describe them, by id: the work of a process."""
    return {each.id: _run(each) for each in run_again(rows)}


def _case(scenario: Scenario, robot: int, q: Array, *, drawn: bool) -> dict[str, Any]:
    around = surroundings(scenario, q) if drawn else None
    return {
        "robot": robot,
        "certificate": [str(claim) for claim in scenario.certificate.claims],
        "messages": around.messages if around else [],
        "path": around.path if around else [],
    }


def _run(again: RunAgain) -> dict[str, Any]:
    """Describe a run at its instants.

    Returns:
        dt: control period [s]; step: numbers of the instants, ascending; columns: the coordinates
        of the joints (see `joint_coordinates`), then x, y, z [m] and the quaternion of the target,
        as differences from instant to instant in units of 1e-4; near: for each instant a digit per
        joint (see `joint_nearness`); in_view: configurations that a camera is to
        see; worst: the time of the largest error [s]; error: distance to the target, a rotation
        counted at 0.2 m [mm]; speed: the largest since the instant before over its limit; margin:
        the smallest to a position limit [deg; 57.3 per m where a joint slides]; null where there is
        no limit.
    """
    trace, scenario = again.run.trace, again.scenario
    steps = np.unique(np.linspace(0, trace.steps, min(INSTANTS, trace.steps + 1)).astype(int))
    targets = target_poses(scenario, trace.tau[steps])
    coordinates = joint_coordinates(scenario.robot, trace.q[steps])
    near, series = joint_nearness(trace, scenario, steps), _series(again, steps)
    return {
        "dt": trace.dt,
        "step": steps.tolist(),
        "columns": _differences(np.hstack([coordinates, targets])),
        "near": ["".join(map(str, row)) for row in near.tolist()],
        "in_view": trace.q[steps[:: max(1, len(steps) // POSES_IN_VIEW)]],
        "worst": round(trace.dt * int(steps[np.argmax(np.nan_to_num(series["error"], nan=-1))]), 6),
        **{
            name: [None if not np.isfinite(x) else round(float(x), 3) for x in values]
            for name, values in series.items()
        },
    }


def _series(again: RunAgain, steps: Indices) -> dict[str, Array]:
    """Compute distance to the target [mm], use of the speeds [1] and position margin [deg]."""
    trace, limits = again.run.trace, again.scenario.robot.limits
    error = 1e3 * motion_of(trace, again.scenario).tracking_error[steps]
    speed, margin = np.full((2, len(steps)), np.nan)
    if limits.velocity is not None and trace.steps:
        usage = limits.velocity.usage(trace.applied).max(axis=1)
        # The largest since the instant before, so that no peak is lost.
        speed[1:] = np.maximum.reduceat(usage, steps[:-1])
        speed[0] = usage[0]
    if limits.position is not None:
        at = trace.q[steps][:, limits.q_index]
        room = np.minimum(limits.position.upper - at, at - limits.position.lower)
        margin = np.rad2deg(room.min(axis=1))
    return {"error": error, "speed": speed, "margin": margin}


def _differences(values: Array) -> list[list[int]]:
    """Round columns to units of 1e-4, and take the differences from row to row, by column."""
    whole = np.round(values * STEPS_PER_UNIT).astype(int)
    columns: list[list[int]] = np.diff(whole, axis=0, prepend=0).T.tolist()
    return columns
