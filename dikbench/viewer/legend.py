"""The legend of a replay and its colours."""

from __future__ import annotations

from typing import Final

from dikbench.problem.constraints import CollisionConstraint
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

PATH_COLOURS: Final[dict[Nearness, Rgb]] = {**COLOURS, Nearness.INSIDE: (40, 40, 40)}
"""Colours of the path of the task frame, over that of the target."""

TARGET_COLOUR: Final[Rgb] = (0x56, 0xB4, 0xE9)
"""Colour of the path of the target."""

OBSTACLE_COLOUR: Final[Rgb] = (0x8F, 0x7F, 0xB5)

PAYLOAD_COLOUR: Final[Rgb] = (0x00, 0x9E, 0x73)


def legend(recordings: list[Recording]) -> list[tuple[Rgb, str]]:
    """List the colours in the scene of some recordings, and their meaning."""
    constraints = [c for each in recordings for c in each.scenario.constraints]
    kept = [c for c in constraints if isinstance(c, CollisionConstraint)]
    lines = [
        (TARGET_COLOUR, "blue: path of the target, with the large axes (x red, y green, z blue)"),
        (PATH_COLOURS[Nearness.INSIDE], "black: path of the task frame, inside all limits"),
        (
            COLOURS[Nearness.NEAR],
            f"yellow: links and path from {100 * NEAR_SHARE:.0f} % of a limit of position, speed, "
            "torque or distance",
        ),
        (COLOURS[Nearness.PAST], "orange: links and path past a limit"),
    ]
    if kept:
        lines[1:2] = [
            (PATH_COLOURS[Nearness.INSIDE], f"{lines[1][1]}; line between the nearest bodies")
        ]
    if any(constraint.obstacles for constraint in kept):
        lines.append((OBSTACLE_COLOUR, "violet: obstacles"))
    if any(each.scenario.robot.payload_radius for each in recordings):
        lines.append((PAYLOAD_COLOUR, "green: what is carried"))
    return lines


def name_of(recording: Recording) -> str:
    """Name formulation and solver of a recording."""
    trial = recording.trial
    return f"{trial.formulation}" + ("" if trial.solver == NO_SOLVER else f" with {trial.solver}")


def names_of(recordings: list[Recording]) -> list[str]:
    """Name each of some recordings, with what tells it from the others of its name."""
    names = [name_of(recording) for recording in recordings]
    if len(set(names)) == len(names):
        return names
    parts = [
        (f"{t.scenario}", f"{t.plant} plant", f"by {t.reference}", f"seed {t.seed}")
        for t in (recording.trial for recording in recordings)
    ]
    telling = [k for k, of_each in enumerate(zip(*parts, strict=True)) if len(set(of_each)) > 1]
    return [
        ", ".join([name, *(own[k] for k in telling)])
        for name, own in zip(names, parts, strict=True)
    ]


def captions(recording: Recording, speed: float) -> list[str]:
    """Say what is replayed, in lines."""
    trial, trace = recording.trial, recording.trace
    ended = "" if recording.status == Status.OK.value else f", ended {recording.status}"
    lines = [
        f"{name_of(recording)} on {trial.scenario}",
        f"{trial.plant} plant, reference by {trial.reference}, seed {trial.seed}, "
        f"{trace.steps * trace.dt:.4g} s{ended}, replayed at {speed:g} times the speed",
    ]
    if not recording.is_current:
        lines.append(
            "The source of formulation or scenario has changed since: the target may be another."
        )
    return lines
