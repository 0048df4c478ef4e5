"""Models from the package example-robot-data, which is data without a Python module."""

from __future__ import annotations

import importlib.metadata
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import pinocchio as pin

from dikbench.errors import DikbenchError


@dataclass(frozen=True)
class DataModel:
    """A robot of the package's folder `robots`.

    Attributes:
        urdf: path of the file.
        moving: names of the joints that move, the others are locked at zero; empty: all.
        srdf: path of the file that says which links cannot collide, if there is one.
    """

    urdf: str
    moving: tuple[str, ...] = ()
    srdf: str | None = None

    def __call__(self) -> Any:
        """Build the Pinocchio model."""
        model = pin.buildModelFromUrdf(data_file(self.urdf))
        if not self.moving:
            return model
        moving = self.moving
        locked = [index for index, name in enumerate(model.names) if index and name not in moving]
        return pin.buildReducedModel(model, locked, pin.neutral(model))


def joints(pattern: str, first: int, last: int) -> tuple[str, ...]:
    """Names with consecutive numbers in the place of the braces of a pattern."""
    return tuple(pattern.format(number) for number in range(first, last + 1))


def data_file(path: str) -> str:
    """Where a file of the package's folder `robots` is installed."""
    return str(_data_folder() / path)


def _data_folder() -> Path:
    try:
        distribution = importlib.metadata.distribution("example-robot-data")
    except importlib.metadata.PackageNotFoundError:
        raise DikbenchError(
            "example-robot-data is not installed: pip install example-robot-data"
        ) from None
    for file in distribution.files or ():
        if file.parts[-4:-2] == ("robots", "panda_description"):
            return Path(str(file.locate())).parents[2]
    raise DikbenchError("example-robot-data is installed but holds no robots/panda_description")
