"""Where the published experiments are kept."""

from __future__ import annotations

from pathlib import Path
from typing import Final

FOLDER: Final = Path(__file__).parent / "experiments"
"""TOML files, and the URDF files that they name."""
