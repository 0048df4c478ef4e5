"""The legend of a replay and its colours."""

from __future__ import annotations

from typing import Final

from dikbench.simulation.status import Status
from dikbench.study.trial import NO_SOLVER
from dikbench.viewer.limit_use import NEAR_SHARE, Nearness
from dikbench.viewer.recording import Recording

Rgb = tuple[int, int, int]
"""Red, green, blue, 0 to 255."""

GREY: Final[Rgb] = (158, 168, 181)

COLOURS: Final[dict[Nearness, Rgb]] = {
    Nearness.INSIDE: GREY,
    Nearness.NEAR: (0xF0, 0xC0, 0x00),
    Nearness.PAST: (0xD5, 0x5E, 0x00),
}
"""Colours of links; they differ in brightness, too."""

TARGET_COLOUR: Final[Rgb] = (0x00, 0x72, 0xB2)
"""Colour of the path of the target."""

OBSTACLE_COLOUR: Final[Rgb] = (0x8F, 0x7F, 0xB5)

PAYLOAD_COLOUR: Final[Rgb] = (0x00, 0x9E, 0x73)

LEGEND: Final = (
    (TARGET_COLOUR, "blue: path of the target, with the large axes (x red, y green, z blue)"),
    (COLOURS[Nearness.INSIDE], "grey: links and path of the task frame, inside all limits"),
    (COLOURS[Nearness.NEAR], f"yellow: from {100 * NEAR_SHARE:.0f} % of a limit"),
    (COLOURS[Nearness.PAST], "orange: past a limit"),
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
