"""Models from the package example-robot-data, which is data without a Python module."""

from __future__ import annotations

import importlib.metadata
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pinocchio as pin

from dikbench.errors import DikbenchError


def from_data(
    path: str, moving: tuple[str, ...] = (), root: Callable[[], Any] | None = None
) -> Callable[[], Any]:
    """A function that builds the Pinocchio model of a URDF below the package's folder `robots`.

    Args:
        path: of the file.
        moving: names of the joints that move, the others are locked at zero; empty: all.
        root: makes the joint (`root_joint`, which moves) between world and robot; None: it is
            fixed.
    """

    def build() -> Any:
        file = str(_data_folder() / path)
        model = (
            pin.buildModelFromUrdf(file) if root is None else pin.buildModelFromUrdf(file, root())
        )
        if not moving:
            return model
        kept = {"universe", "root_joint", *moving}
        locked = [index for index, name in enumerate(model.names) if name not in kept]
        return pin.buildReducedModel(model, locked, pin.neutral(model))

    return build


def joints(pattern: str, first: int, last: int) -> tuple[str, ...]:
    """Names with consecutive numbers in the place of the braces of a pattern."""
    return tuple(pattern.format(number) for number in range(first, last + 1))


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
