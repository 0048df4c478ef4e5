"""Writers of small URDFs."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

DATA = Path(__file__).parents[1] / "data" / "urdf"
"""Hand-made URDFs of arms, good ones and bad ones."""


@dataclass(frozen=True)
class Joint:
    """A joint of a serial arm, whose link is 0.3 m long.

    Attributes:
        axis: its direction.
        kind: its type.
        limit: the attributes of its limit element; empty: it has none.
        mimic: the attributes of its mimic element; empty: it has none.
        offset: of its origin from the joint before [m].
    """

    axis: str = "0 0 1"
    kind: str = "revolute"
    limit: str = 'lower="-3" upper="3" effort="10" velocity="2"'
    mimic: str = ""
    offset: str = "0.3 0 0"


SIX = tuple(Joint(axis) for axis in ("0 0 1", "0 1 0", "0 1 0", "1 0 0", "0 1 0", "1 0.2 0.1"))
"""Six joints that move the tool in all directions."""


def write_arm(
    folder: Path, joints: Sequence[Joint], name: str = "arm", *, gripper: Sequence[Joint] = ()
) -> str:
    """Write the URDF of a serial arm j1, j2, ... with the frame `tool`; return its path.

    Args:
        folder: where to.
        joints: the joints from the base to the tool.
        name: of the file and the robot.
        gripper: joints g1, g2, ... of a chain on the last link, beside the tool.
    """
    inertia = '<inertia ixx="1" iyy="1" izz="1" ixy="0" ixz="0" iyz="0"/>'
    inertial = f'<inertial><mass value="1"/>{inertia}</inertial>'
    parts = [f'<link name="l0">{inertial}</link>']
    chains = [("j", "l", "l0", joints), ("g", "k", f"l{len(joints)}", gripper)]
    for letter, link, parent, chain in chains:
        for number, joint in enumerate(chain, start=1):
            child = f"{link}{number}"
            parts.append(
                f'<link name="{child}">{inertial}</link>'
                f'<joint name="{letter}{number}" type="{joint.kind}"><parent link="{parent}"/>'
                f'<child link="{child}"/><origin xyz="{joint.offset}"/><axis xyz="{joint.axis}"/>'
                + (f"<limit {joint.limit}/>" if joint.limit else "")
                + (f"<mimic {joint.mimic}/>" if joint.mimic else "")
                + "</joint>"
            )
            parent = child
    parts.append(
        f'<link name="tool"/><joint name="to_tool" type="fixed"><parent link="l{len(joints)}"/>'
        '<child link="tool"/><origin xyz="0.3 0 0"/></joint>'
    )
    path = folder / f"{name}.urdf"
    path.write_text(f'<robot name="{name}">{"".join(parts)}</robot>')
    return str(path)
