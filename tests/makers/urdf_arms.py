"""Small arms as URDF files."""

from __future__ import annotations

from pathlib import Path

SIX = (
    ("0 0 0.15", "0 0 1"),
    ("0 0.05 0.05", "0 1 0"),
    ("0 0 0.4", "0 1 0"),
    ("0 0 0.35", "0 1 0"),
    ("0 0.1 0", "0 0 1"),
    ("0 0 0.1", "0 1 0"),
)
"""Origin [m] and axis of the joints of an arm in space."""


def write_urdf(
    path: Path,
    *,
    velocity: float = 3.0,
    effort: float = 150.0,
    radius: float = 0.0,
    elsewhere: int = 0,
) -> str:
    """Write an arm of six joints with the frame `tool`, and return the file's path.

    Args:
        path: the file.
        velocity: limit of every joint [rad/s]; 0 for none.
        effort: the same [N m].
        radius: of spheres along the links, their collision geometry [m]; 0 for none.
        elsewhere: number of joints on the base that do not move the frame, three in a row.
    """
    limit = f'<limit lower="-2.8" upper="2.8" velocity="{velocity}" effort="{effort}"/>'
    ball = f'<geometry><sphere radius="{radius}"/></geometry>'
    balls = "".join(
        f'<collision><origin xyz="0 0 {height}"/>{ball}</collision>' for height in (0.0, 0.1, 0.2)
    )

    def link(name: str, geometry: str = "") -> str:
        inertia = '<inertia ixx=".01" iyy=".01" izz=".01" ixy="0" ixz="0" iyz="0"/>'
        return (
            f'<link name="{name}"><inertial><mass value="1"/>{inertia}</inertial>{geometry}</link>'
        )

    def joint(name: str, parent: str, origin: str, axis: str) -> str:
        ends = f'<parent link="{parent}"/><child link="{name}"/><origin xyz="{origin}"/>'
        return f'<joint name="to_{name}" type="revolute">{ends}<axis xyz="{axis}"/>{limit}</joint>'

    parts, parent = [link("base", balls if radius else "")], "base"
    for number, (origin, axis) in enumerate(SIX):
        name = f"link{number}"
        parts += [link(name, balls if radius else ""), joint(name, parent, origin, axis)]
        parent = name
    fixed = f'<parent link="{parent}"/><child link="tool"/><origin xyz="0 0.08 0.05"/>'
    parts += ['<link name="tool"/>', f'<joint name="tool_fixed" type="fixed">{fixed}</joint>']
    for number in range(elsewhere):
        parent = "base" if number % 3 == 0 else f"other{number - 1}"
        name = f"other{number}"
        parts += [link(name), joint(name, parent, "0 0 0.1", "0 1 0")]
    path.write_text(f'<robot name="{path.stem}">{"".join(parts)}</robot>')
    return str(path)
