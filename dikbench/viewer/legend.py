"""The legend of a replay and its colours."""

from __future__ import annotations

from typing import Final

from dikbench.simulation.status import Status
from dikbench.study.trial import NO_SOLVER
from dikbench.viewer.limit_use import NEAR_SHARE, Nearness
from dikbench.viewer.recording import Recording

COLOURS: Final = {Nearness.INSIDE: 0x009E73, Nearness.NEAR: 0xF0C000, Nearness.PAST: 0xC00030}
"""Colours of joints and of the path of the task frame; they differ in brightness, too."""

TARGET_COLOUR: Final = 0x0072B2
"""Colour of the path of the target."""

LEGEND: Final = (
    (TARGET_COLOUR, "blue: path of the target, with the large axes (x red, y green, z blue)"),
    (COLOURS[Nearness.INSIDE], "green: path of the task frame, joints; inside all limits"),
    (COLOURS[Nearness.NEAR], f"yellow: from {100 * NEAR_SHARE:.0f} % of a position or speed limit"),
    (COLOURS[Nearness.PAST], "red: past a limit"),
)
"""Colours and their meaning."""


def captions(recording: Recording, speed: float) -> list[str]:
    """Say what is replayed, in lines."""
    trial, trace = recording.trial, recording.trace
    solver = "" if trial.solver == NO_SOLVER else f" with {trial.solver}"
    ended = "" if recording.status == Status.OK.value else f", ended {recording.status}"
    lines = [
        f"{trial.formulation}{solver} on {trial.scenario}",
        f"{trial.plant} plant, reference by {trial.reference}, seed {trial.seed}, "
        f"{trace.steps * trace.dt:.4g} s{ended}, replayed at {speed:g} times the speed",
    ]
    if not recording.is_current:
        lines.append(
            "The source of formulation or scenario has changed since: the target may be another."
        )
    return lines
