"""What one needs of a formulation, and whether a run met it."""

from __future__ import annotations

import re
from dataclasses import dataclass
from typing import Final, Literal

import pandas as pd

from dikbench.arrays import Mask
from dikbench.errors import DikbenchError
from dikbench.statistics.first_places import BROKEN
from dikbench.statistics.success import Setting, succeeded_at

Kind = Literal["on-path", "on-time", "limits"]

DEFAULTS: Final = ("on-path=5mm", "on-time=5mm", "limits")
"""What is answered where nothing is asked for."""

UNITS: Final = {"m": 1.0, "cm": 1e-2, "mm": 1e-3, "um": 1e-6}

VALID: Final = "valid: on-path=1mm, on-time=5mm or limits"

_FORM = re.compile(r"(?P<kind>[a-z-]+)(=(?P<value>[0-9.eE+-]+) ?(?P<unit>[a-z]*))?")


@dataclass(frozen=True)
class Need:
    """A need.

    Attributes:
        kind: `on-path`: every limit kept, and all of the path done within a tolerance, the path
            waiting for the robot; `on-time`: the same by the clock, and where that asks for more
            than the joints can do, to give way and come back; `limits`: no limit broken in any run.
        tolerance: [m]; of `limits` without meaning.
    """

    kind: Kind
    tolerance: float = 0.005

    @property
    def setting(self) -> Setting:
        """The setting whose runs count."""
        return "time" if self.kind == "on-time" else "path"

    def met(self, trials: pd.DataFrame) -> Mask:
        """Say which of the trials met it."""
        if self.kind == "limits":
            kept: Mask = (~trials["outcome"].isin(BROKEN)).to_numpy()
            return kept
        return succeeded_at(trials, self.tolerance)

    def __str__(self) -> str:
        """Write it in words."""
        tolerance = f"{1000 * self.tolerance:g} mm"
        return {
            "on-path": f"stay within {tolerance} of a path that may wait, every limit kept",
            "on-time": f"stay within {tolerance} of the path by the clock, or give way and come "
            "back, every limit kept",
            "limits": "break no limit",
        }[self.kind]

    @property
    def failed(self) -> str:
        """What a run did that did not meet it."""
        return {
            "on-path": "left it, broke a limit or did not finish",
            "on-time": "left it, broke a limit, came late or did not come back",
            "limits": "broke one",
        }[self.kind]


def parsed_need(text: str) -> Need:
    """Read a need: `on-path=1mm`, `on-time=5mm`, `limits`.

    Raises:
        DikbenchError: if it is none.
    """
    match = _FORM.fullmatch(text.strip())
    kind = match["kind"] if match else ""
    if match is None or kind not in ("on-path", "on-time", "limits"):
        raise DikbenchError(f"need {text!r} is not known; {VALID}")
    if kind == "limits":
        if match["value"]:
            raise DikbenchError(f"need {text!r}: limits has no value; {VALID}")
        return Need("limits")
    try:
        unit = match["unit"] if match["value"] else "m"
        tolerance = float(match["value"] or "5e-3") * UNITS[unit]
    except (ValueError, KeyError):
        tolerance = 0.0
    if not 0 < tolerance <= 1:
        raise DikbenchError(
            f"need {text!r}: it takes a distance above 0 and at most 1 m, in "
            f"{', '.join(UNITS)}; {VALID}"
        )
    return Need("on-path" if kind == "on-path" else "on-time", tolerance)
