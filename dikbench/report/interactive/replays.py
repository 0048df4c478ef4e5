"""The runs that the page replays: joints, target and what they came to over time, in few bytes."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any, Final

import numpy as np
import pandas as pd

from dikbench.arrays import Array, Indices
from dikbench.metrics import motion_of
from dikbench.report.interactive.chosen_runs import chosen_runs
from dikbench.run.again import RunAgain, run_again
from dikbench.scenario.scenario import Scenario
from dikbench.viewer.limit_use import joint_nearness
from dikbench.viewer.moving_joints import joint_coordinates
from dikbench.viewer.static_scene import static_scene, surroundings
from dikbench.viewer.target_poses import target_poses
from dikbench.viewer.viser_client import client_html, has_viser

INSTANTS: Final = 150
"""Of a run, at most, evenly spaced."""

STEPS_PER_UNIT: Final = 1e4
"""What is embedded is rounded to 1e-4 (rad, m, 1)."""


def make_replays(trials: pd.DataFrame, rows: pd.DataFrame) -> dict[str, Any]:
    """Run the chosen trials of a page again and describe them for its script.

    Returns:
        runs: by id the index of its case, and the series of the run (see `_run`).
        cases: of each scenario with its seed its robot's index, certificate and, with viser, what
            surrounds the robot and the path of the target.
        robots: the scenes (see `static_scene`), and client, viser's; both empty without viser.
    """
    seconds = trials.drop_duplicates("id").set_index("id")["control_time_s"].astype(float)
    wanted = trials[trials["id"].isin(chosen_runs(rows, seconds))]
    found: list[Any] = wanted.to_dict("records")
    return describe(run_again(found), drawn=has_viser())


def describe(runs: Iterable[RunAgain], *, drawn: bool) -> dict[str, Any]:
    """Describe runs, with their scenes where they are drawn (see `make_replays`)."""
    found: dict[str, Any] = {}
    cases: dict[int, tuple[int, dict[str, Any]]] = {}
    robots: dict[tuple[str, str], tuple[int, Any]] = {}
    kept: list[Scenario] = []  # so that their identities stay theirs
    for each in runs:
        scenario = each.scenario
        if id(scenario) not in cases:
            kept.append(scenario)
            key = (scenario.robot.name, scenario.robot.frame)
            if key not in robots:
                scene = static_scene(scenario.robot) if drawn else None
                robots[key] = (len(robots), scene)
            cases[id(scenario)] = (len(cases), _case(scenario, robots[key][0], drawn=drawn))
        found[each.id] = {"case": cases[id(scenario)][0], **_run(each)}
    return {
        "runs": found,
        "cases": [case for _, case in cases.values()],
        "robots": [
            {"data": scene.data, "joints": scene.joints} for _, scene in robots.values() if scene
        ],
        "client": client_html() if drawn and found else "",
    }


def _case(scenario: Scenario, robot: int, *, drawn: bool) -> dict[str, Any]:
    around = surroundings(scenario) if drawn else None
    return {
        "robot": robot,
        "certificate": [str(claim) for claim in scenario.certificate.claims],
        "messages": around.messages if around else [],
        "path": around.path if around else [],
    }


def _run(again: RunAgain) -> dict[str, Any]:
    """Describe a run at its instants.

    Returns:
        dt: control period [s]; step: numbers of the instants, ascending; joints: their coordinates
        (see `joint_coordinates`) and target: x, y, z [m] and the quaternion, both as differences
        from instant to instant in units of 1e-4, column by column; near: for each instant a digit
        per joint (see `joint_nearness`); error: distance to the target,
        a rotation counted at 0.2 m [mm]; speed: the
        largest over its limit; margin: the smallest to a position limit [deg; 57.3 per m where a
        joint slides]; null where there is no limit.
    """
    trace, scenario = again.run.trace, again.scenario
    steps = np.unique(np.linspace(0, trace.steps, min(INSTANTS, trace.steps + 1)).astype(int))
    targets = target_poses(scenario, trace.tau[steps])
    near = joint_nearness(trace, scenario, steps)
    return {
        "dt": trace.dt,
        "step": steps.tolist(),
        "joints": _differences(joint_coordinates(scenario.robot, trace.q[steps])),
        "target": _differences(targets),
        "near": ["".join(map(str, row)) for row in near.tolist()],
        **{
            name: [None if not np.isfinite(x) else round(float(x), 3) for x in values]
            for name, values in _series(again, steps).items()
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
