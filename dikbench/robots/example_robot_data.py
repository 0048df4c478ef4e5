"""Models from the package example-robot-data, which has no Python module."""

from __future__ import annotations

import importlib.metadata
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import pinocchio as pin

from dikbench.errors import DikbenchError
from dikbench.robots.reduced_model import reduced_geometry, reduced_model


@dataclass(frozen=True)
class DataModel:
    """A robot of the package's folder `robots`; a call builds its Pinocchio model.

    Attributes:
        urdf: path of the file.
        moving: names of the joints that move, the others are locked at zero; empty: all.
        root: makes the moving joint (`root_joint`) between world and robot; None if the robot is
            fixed.
        srdf: path of the file that lists which links cannot collide, or None.
    """

    urdf: str
    moving: tuple[str, ...] = ()
    root: Callable[[], Any] | None = None
    srdf: str | None = None

    def __call__(self) -> Any:
        """Build the Pinocchio model."""
        model = self._whole()
        if not self.moving:
            return model
        return reduced_model(model, self._locked(model), pin.neutral(model))

    def visuals(self) -> Any:
        """Build its visual geometry with meshes (`pinocchio.GeometryModel`)."""
        model = self._whole()
        visuals = urdf_visuals(model, data_file(self.urdf), _data_folder().parents[1])
        if not self.moving:
            return visuals
        return reduced_geometry(model, visuals, self._locked(model), pin.neutral(model))

    def _whole(self) -> Any:
        file = data_file(self.urdf)
        if self.root is None:
            return pin.buildModelFromUrdf(file)
        return pin.buildModelFromUrdf(file, self.root())

    def _locked(self, model: Any) -> list[int]:
        kept = {"universe", "root_joint", *self.moving}
        return [n for n, name in enumerate(model.names) if name not in kept]


def urdf_visuals(model: Any, file: str, packages: Path) -> Any:
    """Build the visual geometry of a URDF (`pinocchio.GeometryModel`).

    Args:
        model: the Pinocchio model of the whole file.
        file: the URDF.
        packages: folder of the packages that its meshes refer to.

    Raises:
        ValueError: if a mesh is not found or not read.
    """
    return pin.buildGeomFromUrdf(model, file, pin.GeometryType.VISUAL, package_dirs=[str(packages)])


def joints(pattern: str, first: int, last: int) -> tuple[str, ...]:
    """Number names consecutively in the place of the braces of a pattern."""
    return tuple(pattern.format(number) for number in range(first, last + 1))


def data_file(path: str) -> str:
    """Return where a file of the package's folder `robots` is installed."""
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
