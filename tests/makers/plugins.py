"""Makers of plug-ins in files, as users write them."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

Install = Callable[..., None]
"""What the fixture `install` gives: it replaces every registered plug-in of a group."""


def law_with(folder: Path, fields: str, imports: str = "") -> str:
    """Write a formulation with these fields, and give its selector."""
    path = folder / "law.py"
    path.write_text(
        "from __future__ import annotations\n"
        "from dataclasses import dataclass\n"
        f"{imports}\n"
        "@dataclass(frozen=True)\n"
        "class Law:\n"
        f"    {fields}\n"
        "    def velocity(self, problem, solve):\n"
        "        return None\n"
    )
    return f"{path}:Law"
