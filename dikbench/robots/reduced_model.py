"""Models with some joints locked, of URDF files too that give a link and a joint one name."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from typing import Any, Final

import pinocchio as pin

from dikbench.arrays import Array

MARK: Final = " (joint)"
"""What a joint's name ends with as long as Pinocchio must distinguish it from a link's."""


def reduced_model(model: Any, locked: Sequence[int], q: Array) -> Any:
    """Build the Pinocchio model with joints locked.

    Args:
        model: the model; it is not changed.
        locked: ids of the joints.
        q: the configuration at which they are locked, (nq,).
    """
    return _with_names_of_before(pin.buildReducedModel(_distinct(model), list(locked), q))


def reduced_geometry(model: Any, geometry: Any, locked: Sequence[int], q: Array) -> Any:
    """Build the geometry of a model with joints locked (see `reduced_model`)."""
    return pin.buildReducedModel(_distinct(model), geometry, list(locked), q)[1]


def _distinct(model: Any) -> Any:
    """Mark joints that have the name of a link, which `buildReducedModel` does not take."""
    counts = Counter(frame.name for frame in model.frames)
    twice = {name for name, count in counts.items() if count > 1}
    if not twice:
        return model
    marked = model.copy()
    for frame in marked.frames:
        if frame.name in twice and frame.type != pin.FrameType.BODY:
            frame.name += MARK
    for index, name in enumerate(model.names):
        if name in twice:
            marked.names[index] = name + MARK
    return marked


def _with_names_of_before(model: Any) -> Any:
    for frame in model.frames:
        frame.name = frame.name.removesuffix(MARK)
    for index, name in enumerate(list(model.names)):
        model.names[index] = name.removesuffix(MARK)
    return model
