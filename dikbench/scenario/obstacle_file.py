"""Obstacles from a user's TOML file."""

from __future__ import annotations

import os.path

import msgspec

from dikbench.errors import DikbenchError
from dikbench.robots.collision.obstacles import (
    IDENTITY_ROTATION,
    BoxObstacle,
    CapsuleObstacle,
    Obstacle,
    SphereObstacle,
)

Vector = tuple[float, float, float]


class _Sphere(msgspec.Struct, forbid_unknown_fields=True):
    centre: Vector
    radius: float

    def obstacle(self) -> Obstacle:
        return SphereObstacle(self.centre, self.radius)


class _Capsule(msgspec.Struct, forbid_unknown_fields=True):
    start: Vector
    end: Vector
    radius: float

    def obstacle(self) -> Obstacle:
        return CapsuleObstacle(self.start, self.end, self.radius)


class _Box(msgspec.Struct, forbid_unknown_fields=True):
    centre: Vector
    size: Vector
    rotation: tuple[Vector, Vector, Vector] = IDENTITY_ROTATION

    def obstacle(self) -> Obstacle:
        return BoxObstacle(self.centre, self.size, self.rotation)


class _Obstacles(msgspec.Struct, forbid_unknown_fields=True):
    sphere: tuple[_Sphere, ...] = ()
    capsule: tuple[_Capsule, ...] = ()
    box: tuple[_Box, ...] = ()


def read_obstacles(path: str) -> tuple[Obstacle, ...]:
    """Read spheres, capsules and boxes, in metres in the world, from a TOML file.

        [[sphere]]
        centre = [0.4, 0.1, 0.5]
        radius = 0.05

        [[capsule]]
        start = [0.4, 0.1, 0.0]
        end = [0.4, 0.1, 0.6]
        radius = 0.02

        [[box]]
        centre = [0.5, 0.0, -0.02]
        size = [1.0, 1.0, 0.04]
        rotation = [[1, 0, 0], [0, 1, 0], [0, 0, 1]]    # rows; may be left out

    Raises:
        DikbenchError: if the file is missing, is no TOML, has another table or key than these, a
            value is not valid, or there is no obstacle.
    """
    where = f"obstacle file {path}"
    if not os.path.isfile(path):
        raise DikbenchError(f"obstacle file not found: {path}")
    try:
        with open(path, "rb") as file:
            found = msgspec.toml.decode(file.read(), type=_Obstacles)
    except OSError as error:
        raise DikbenchError(f"{where}: {error.strerror or error}") from None
    except UnicodeDecodeError:
        raise DikbenchError(f"{where}: not a text file in UTF-8") from None
    except msgspec.ValidationError as error:
        raise DikbenchError(f"{where}: {error}; valid: {_VALID}") from None
    except msgspec.DecodeError as error:
        raise DikbenchError(f"{where}: not valid TOML: {error}") from None
    obstacles: list[Obstacle] = []
    for name in ("sphere", "capsule", "box"):
        for number, each in enumerate(getattr(found, name), start=1):
            try:
                obstacles.append(each.obstacle())
            except DikbenchError as error:
                raise DikbenchError(f"{where}: {name} {number}: {error}") from None
    if not obstacles:
        raise DikbenchError(f"{where}: no obstacle; valid: {_VALID}")
    return tuple(obstacles)


_VALID = ", ".join(
    f"[[{name}]] with {', '.join(field.name for field in msgspec.structs.fields(kind))}"
    for name, kind in (("sphere", _Sphere), ("capsule", _Capsule), ("box", _Box))
)
