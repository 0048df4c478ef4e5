"""The robots known by name."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from math import pi
from types import MappingProxyType
from typing import Any

import numpy as np
import pinocchio as pin

from dikbench.robots.denavit_hartenberg import denavit_hartenberg_arm
from dikbench.robots.example_robot_data import DataModel, joints
from dikbench.robots.omnidirectional_base import omnidirectional_base
from dikbench.robots.planar_arm import planar_arm

UR_START = (0.3, -1.2, 1.4, -1.7, -1.4, 0.2)
NOT_PUBLISHED = "no data sheet or manual gives any"
IN_CODE_ONLY = "chosen for this robot, which exists in code only"
LWR_TABLE = tuple(
    (0.0, turn * pi / 2, d)
    for turn, d in zip((1, -1, -1, 1, 1, -1, 0), (0.3105, 0, 0.40, 0, 0.39, 0, 0.078), strict=True)
)
"""a [m], alpha [rad], d [m]; lengths as in Flacco, De Luca & Khatib 2015."""
HALF_SITTING = (
    *(0, 0, 1.01927, 0, 0, 0),
    *(0, 0, -0.411354, 0.859395, -0.448041, -0.001708),
    *(0, 0, -0.411354, 0.859395, -0.448041, -0.001708),
    *(0, 0.006761),
    *(0.258470, 0.6, -0.0002, -1.2, 0, 0, 0.1),
    *(-0.258470, -0.6, 0.0002, -1.2, 0, 0, 0.1),
    *(0, 0),
)
"""Base, left and right leg, torso, left and right arm, head: the half-sitting posture of Talos'
SRDF with the elbows bent from 0.5 to 1.2 rad and the arms 0.4 rad farther from the body, away from
limits."""
UR_SRDF = "ur_description/srdf/ur5_gripper.srdf"
"""The UR5's; the UR3 and the UR10 have the same links in the same order."""
UR_ACCELERATION_SOURCE = (
    "joint speed limit over 0.5 s, the braking ramp that the safety system enforces "
    "(UR10/CB3 user manual, safety inputs)"
)


@dataclass(frozen=True)
class CatalogueEntry:
    """A robot of the catalogue: its model and what the model file does not contain.

    Attributes:
        summary: one line for `dikbench list robots`.
        model: builds the Pinocchio model.
        frame: the default task frame.
        start: a safe start, away from limits and singularities, (nv,) [rad].
        acceleration: acceleration limits, (nv,) [rad/s^2], or None; no model file has any.
        acceleration_source: where they are from.
        task_rows: see `Robot`.
    """

    summary: str
    model: Callable[[], Any]
    frame: str
    start: tuple[float, ...]
    acceleration: tuple[float, ...] | None
    acceleration_source: str
    task_rows: tuple[int, ...] = (0, 1, 2, 3, 4, 5)


def _universal_robot(
    name: str, sister: str, acceleration: tuple[float, float, float, float, float, float]
) -> CatalogueEntry:
    return CatalogueEntry(
        summary=f"Universal Robots {name.upper()}, 6 joints, {sister}",
        model=DataModel(f"ur_description/urdf/{name}_robot.urdf", srdf=UR_SRDF),
        frame="tool0",
        start=UR_START,
        acceleration=acceleration,
        acceleration_source=UR_ACCELERATION_SOURCE,
    )


ROBOTS: Mapping[str, CatalogueEntry] = MappingProxyType(
    {
        "panda": CatalogueEntry(
            summary="Franka Emika Panda, 7 joints, fingers locked",
            model=DataModel(
                "panda_description/urdf/panda.urdf",
                moving=joints("panda_joint{}", 1, 7),
                srdf="panda_description/srdf/panda.srdf",
            ),
            frame="panda_hand_tcp",
            start=(0, -pi / 4, 0, -3 * pi / 4, 0, pi / 2, pi / 4),
            acceleration=(15, 7.5, 10, 12.5, 15, 20, 20),
            acceleration_source="Franka Control Interface, joint limits of the Panda",
        ),
        "ur3": _universal_robot("ur3", "the UR5's small sister", (4.32, 4.32, 6.3, 6.4, 6.4, 6.4)),
        "ur5": _universal_robot("ur5", "spherical-like wrist", (6.3, 6.3, 6.3, 6.4, 6.4, 6.4)),
        "ur10": _universal_robot(
            "ur10", "the UR5's longer sister", (4.32, 4.32, 6.3, 6.4, 6.4, 6.4)
        ),
        "xarm7": CatalogueEntry(
            summary="UFACTORY xArm7, 7 joints; its zero posture is singular",
            model=DataModel(
                "xarm_description/urdf/xarm7.urdf", srdf="xarm_description/srdf/xarm7.srdf"
            ),
            frame="link_eef",
            start=(0, -0.5, 0, 1.0, 0, 1.3, 0),
            acceleration=(20,) * 7,
            acceleration_source="UFACTORY xArm SDK, joint acceleration at most 20 rad/s^2",
        ),
        "kinova": CatalogueEntry(
            summary="Kinova Jaco 2 (j2s6s200), 6 joints, three of them continuous",
            model=DataModel("kinova_description/robots/kinova.urdf"),
            frame="j2s6s200_end_effector",
            start=(0, 2.9, 1.3, -2.07, 1.4, 0),
            acceleration=None,
            acceleration_source=NOT_PUBLISHED,
        ),
        "tiago": CatalogueEntry(
            summary="the arm of PAL Robotics' TIAGo, 7 joints, torso, head and wheels locked",
            model=DataModel(
                "tiago_description/robots/tiago_no_hand.urdf", moving=joints("arm_{}_joint", 1, 7)
            ),
            frame="arm_tool_link",
            start=(1.4, -0.4, -1.2, 1.5, 0, -0.5, 0.4),
            acceleration=None,
            acceleration_source=NOT_PUBLISHED,
        ),
        "talos": CatalogueEntry(
            summary="the left arm of PAL Robotics' Talos, 7 joints, all others locked",
            model=DataModel(
                "talos_data/robots/talos_reduced.urdf",
                moving=joints("arm_left_{}_joint", 1, 7),
                srdf="talos_data/srdf/talos.srdf",
            ),
            frame="gripper_left_base_link",
            start=(-0.4, 0.9, 0.6, -1.5, 0.5, 0.5, -0.1),
            acceleration=None,
            acceleration_source=NOT_PUBLISHED,
        ),
        "talos-humanoid": CatalogueEntry(
            summary="PAL Robotics' Talos on its feet: a free base and 30 joints, grippers locked",
            model=DataModel(
                "talos_data/robots/talos_reduced.urdf",
                moving=(
                    *joints("leg_left_{}_joint", 1, 6),
                    *joints("leg_right_{}_joint", 1, 6),
                    *joints("torso_{}_joint", 1, 2),
                    *joints("arm_left_{}_joint", 1, 7),
                    *joints("arm_right_{}_joint", 1, 7),
                    *joints("head_{}_joint", 1, 2),
                ),
                root=pin.JointModelFreeFlyer,
            ),
            frame="gripper_right_base_link",
            start=HALF_SITTING,
            acceleration=None,
            acceleration_source=NOT_PUBLISHED,
        ),
        "lwr": CatalogueEntry(
            summary="KUKA LWR, 7 joints, kinematics only, from its Denavit-Hartenberg table",
            model=lambda: denavit_hartenberg_arm(
                "lwr",
                LWR_TABLE,
                position_limits=tuple(np.deg2rad((170, 120, 170, 120, 170, 120, 170))),
                velocity_limits=tuple(np.deg2rad((100, 110, 100, 130, 130, 180, 180))),
            ),
            frame="tool",
            start=(0.0, pi / 4, pi / 4, pi / 4, pi / 4, pi / 4, 0.0),
            acceleration=(5 * pi / 3,) * 7,
            acceleration_source="Flacco, De Luca & Khatib 2015 (300 deg/s^2)",
        ),
        "planar1r": CatalogueEntry(
            summary="one joint with limits 0 and 2 pi, that turns a link of 0.4 m",
            model=lambda: planar_arm((0.4,), velocity_limits=(2.0,), position_limit=(0, 2 * pi)),
            frame="tip",
            start=(pi,),
            acceleration=(10.0,),
            acceleration_source=IN_CODE_ONLY,
            task_rows=(5,),
        ),
        "planar4r": CatalogueEntry(
            summary="a planar arm of four links of 0.25 m, built in code",
            model=lambda: planar_arm((0.25,) * 4, velocity_limits=(2.0, 2.0, 4.0, 4.0)),
            frame="tip",
            start=(0.0, pi / 2, -pi / 2, pi / 2),
            acceleration=(2.0, 2.0, 4.0, 4.0),
            acceleration_source="Flacco, De Luca & Khatib 2015",
            task_rows=(0, 1, 5),
        ),
        "base": CatalogueEntry(
            summary="an omnidirectional mobile base in the plane, without limits",
            model=omnidirectional_base,
            frame="base",
            start=(0.0, 0.0, 0.0),
            acceleration=None,
            acceleration_source=IN_CODE_ONLY,
            task_rows=(0, 1, 5),
        ),
        "planar3r": CatalogueEntry(
            summary="a planar arm of three links (0.4, 0.3, 0.2 m), built in code",
            model=lambda: planar_arm((0.4, 0.3, 0.2), velocity_limits=(2.0,) * 3),
            frame="tip",
            start=(0.3, 1.6, 0.6),
            acceleration=(10.0, 10.0, 10.0),
            acceleration_source=IN_CODE_ONLY,
            task_rows=(0, 1, 5),
        ),
    }
)
