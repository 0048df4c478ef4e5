"""Singular postures of known arms, by name: seeds of the exact postures."""

from __future__ import annotations

from collections.abc import Mapping
from math import atan, pi
from types import MappingProxyType
from typing import Literal, NamedTuple

SingularityName = Literal["wrist", "elbow", "shoulder"]


class SingularPosture(NamedTuple):
    """A posture near a singular one.

    Attributes:
        posture: joint by joint from the neutral configuration, (nv,) [rad].
        half_length: s0, half the length of the path past it: [rad] of a joint at a crossing, else
            along the unit twist, mostly a translation [m].
    """

    posture: tuple[float, ...]
    half_length: float


PANDA_STRETCHED_RAD = -(atan(0.0825 / 0.316) + atan(0.0825 / 0.384))
"""Angle of the Panda's elbow when stretched, from the offsets and lengths of its arm [m]."""

_UR_WRIST = SingularPosture((0.3, -1.2, 1.4, -1.0, 0.0, 0.2), 0.3)


def _ur_elbow(half_length: float) -> SingularPosture:
    return SingularPosture((0.3, -1.2, 0.0, -1.0, -1.4, 0.2), half_length)


def _ur_shoulder(half_length: float) -> SingularPosture:
    return SingularPosture((0.3, -2.37656, 1.4, -1.0, 0.9, 0.2), half_length)


SINGULAR_POSTURES: Mapping[str, Mapping[SingularityName, SingularPosture]] = MappingProxyType(
    {
        "ur3": {"wrist": _UR_WRIST, "elbow": _ur_elbow(0.13), "shoulder": _ur_shoulder(0.06)},
        "ur5": {"wrist": _UR_WRIST, "elbow": _ur_elbow(0.15), "shoulder": _ur_shoulder(0.12)},
        "ur10": {"wrist": _UR_WRIST, "elbow": _ur_elbow(0.15), "shoulder": _ur_shoulder(0.15)},
        "panda": {
            "elbow": SingularPosture((0.0, 0.3, 0.0, PANDA_STRETCHED_RAD, 0.0, 1.6, pi / 4), 0.15),
            "shoulder": SingularPosture((0.3, 0.0, pi / 2, -1.8, 0.0, 1.6, 0.4), 0.1),
            "wrist": SingularPosture((0.0, 0.3, 0.0, -2.0, pi / 2, 3.364, 0.4), 0.1),
        },
        "xarm7": {
            "elbow": SingularPosture((0.0, -0.5, 0.0, 2.742, 0.0, 1.65, 0.0), 0.1),
            "shoulder": SingularPosture((0.3, 0.0, pi / 2, 1.2, 0.0, 1.3, 0.0), 0.1),
            "wrist": SingularPosture((0.15, 0.35, -0.43, 1.25, pi / 2, -0.22, 0.91), 0.1),
        },
        "kinova": {
            "wrist": SingularPosture((0.0, 2.9, 1.3, -2.07, pi, 0.0), 0.3),
            "elbow": SingularPosture((1.13, 3.56, pi, -1.45, 1.63, 1.0), 0.1),
            "shoulder": SingularPosture((0.03, 2.25, 0.66, -1.15, 1.88, 0.09), 0.1),
        },
        "tiago": {
            "wrist": SingularPosture((1.4, -0.4, -1.2, 1.47, 0.0, 0.0, 0.5), 0.1),
            "elbow": SingularPosture((1.7, -1.13, -1.82, 0.14, 0.05, -0.55, 0.5), 0.1),
        },
        "talos": {
            "elbow": SingularPosture((-0.51, 1.11, 1.42, -0.15, 0.18, 0.38, -0.42), 0.1),
        },
    }
)
"""The first posture of a robot is its default.

UR: q5 = 0, q3 = 0, and the wrist's centre on the cylinder about the first axis. Panda: stretched
with q5 = 0, q2 = q5 = 0 with q3 = pi/2, and q5 = pi/2 with a q6 that depends on q4. The others were
found with `dikbench.scenario.singularity`; the wrist and shoulder of Talos and the shoulder of
TIAGo are singular only outside the joints' limits.
"""
