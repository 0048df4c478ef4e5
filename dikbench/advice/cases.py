"""The cases on which formulations are tried for an arm: instances of families, the given path."""

from __future__ import annotations

import csv
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Final

import pinocchio as pin

from dikbench.advice.arm import Arm
from dikbench.errors import DikbenchError
from dikbench.plugins.building import make_scenario
from dikbench.plugins.drawing import Cell
from dikbench.robots.catalogue import ROBOTS
from dikbench.scenario.reference.pose_file import read_poses
from dikbench.selector import Selector, parse_selector
from dikbench.study.instances import draw
from dikbench.study.split import SPLITS

FAMILIES: Final = (
    "near-miss",
    "speed-sweep",
    "joint-limit-graze",
    "random-joint-path[points=3,speed=1.0]",
    "pick-and-place",
    "joint-limit-detour",
    "step",
    "workspace-boundary[path=out-and-back,extent=1.0]",
)
"""In the order in which they take turns. Random joint paths are as fast as the joints, since slow
ones take as long as all others together, and paths to the boundary end there, since of those that
lead beyond it nobody can do anything."""

WITH_ACCELERATION: Final = (
    "random-joint-path[points=3,speed=0.5]",
    "speed-sweep",
    "step",
    "joint-limit-graze",
    "back-and-forth",
    "reach",
)
"""What is run where acceleration limits are in force: of near misses and of paths with corners no
motion is known then that keeps all limits, so that they count nowhere."""

SPARE: Final = ("reach", "back-and-forth")
"""What is run in addition on an arm that hardly any of them fits, as on one of thirteen joints."""

FEWEST_FAMILIES: Final = 3
"""Fewer families than that are hardly any."""

PATH_FAMILY: Final = "csv"

FASTER: Final = (1.0, 1.5, 2.5)
"""The given path is run as it is, and so many times as fast."""

MOST_ATTEMPTS: Final = 8
"""A family of which so many draws in a row are rejected is left out."""

NUMBERS_APART: Final = 40
"""Instances of advice with another seed begin so many numbers later."""


@dataclass
class Cases:
    """The cases of an arm, one after the other.

    Attributes:
        given: what each family is given.
        number: of the first instances.
        spare: families that are added where fewer than `FEWEST_FAMILIES` are left.
        left_out: why families have no case, by family.
    """

    given: dict[str, Selector]
    number: int
    spare: Mapping[str, Selector] = field(default_factory=dict)
    left_out: dict[str, str] = field(default_factory=dict)

    def __iter__(self) -> Iterator[Cell]:
        """Yield cases, the families in turn; one whose drawing fails is left out from then on."""
        numbers = SPLITS["test"]
        for number in range(self.number, numbers.stop):
            if len(self.given) - len(self.left_out) < FEWEST_FAMILIES:
                self.given.update(self.spare)
            if len(self.left_out) == len(self.given):
                return
            for family, selector in list(self.given.items()):
                if family in self.left_out:
                    continue
                try:
                    yield self._case(family, selector, number)
                except DikbenchError as error:
                    self.left_out[family] = _in_short(str(error), selector)

    def has(self, family: str) -> bool:
        """Say whether a family is among those that are run."""
        return family in self.given and family not in self.left_out

    def leave_out(self, cell: Cell, why: str) -> None:
        """Leave out from now on the family that gave a case."""
        scenario = cell[0]
        for family, selector in self.given.items():
            same = selector.parameters.get("file") == scenario.parameters.get("file")
            if selector.name == scenario.name and same:
                self.left_out[family] = why

    def _case(self, family: str, selector: Selector, number: int) -> Cell:
        """Draw a case of a family; of the given path the number is the seed."""
        if family.startswith(PATH_FAMILY):
            make_scenario(selector, number)
            return selector, number
        last = draw(selector, [number], most=MOST_ATTEMPTS)[-1]
        return parse_selector(last.scenario), last.seed


def _in_short(reason: str, selector: Selector) -> str:
    """Shorten why a family has no case: the last attempt's reason, a file without its folder."""
    reason = reason.rpartition("the last one: ")[2]
    if reason.startswith("scenario ") and "]: " in reason:
        reason = reason.partition("]: ")[2]
    reason = reason.removeprefix(f"scenario {selector.name}: ")
    robot = selector.parameters["robot"]
    return reason.replace(robot, Path(robot).name)


def cases_for(
    arm: Arm,
    dt: float,
    seed: int,
    path: Path | None,
    obstacles: Path | None,
    folder: Path,
) -> Cases:
    """Make the cases of an arm.

    Args:
        arm: the arm.
        dt: control period [s].
        seed: of the instances that are drawn.
        path: a file of poses that it is to follow, or None.
        obstacles: a file of obstacles about that path, or None.
        folder: where the faster paths are written.

    Raises:
        DikbenchError: if a file cannot be read, or the path cannot be followed at all.
    """
    common = {**arm.parameters, "dt": repr(dt)}
    given: dict[str, Selector] = {}
    if path is not None:
        for factor, file in faster_paths(path, folder).items():
            values = {**common, "file": str(file)}
            if obstacles is not None:
                values["obstacles"] = str(obstacles)
            given[f"{PATH_FAMILY} x{factor:g}"] = Selector(PATH_FAMILY, values)
        make_scenario(given[f"{PATH_FAMILY} x1"])  # out of reach is said at once
    elif obstacles is not None:
        raise DikbenchError(
            f"--obstacles {obstacles}: they stand about a path; valid: together with --path"
        )
    names = WITH_ACCELERATION if "acceleration" in arm.parameters else FAMILIES
    for family in map(parse_selector, names):
        values = {**family.parameters, **common}
        if family.name == "near-miss" and arm.parameters["robot"] not in ROBOTS:
            values["singularity"] = "auto"
        given[family.name] = Selector(family.name, values)
    first = SPLITS["test"].start + NUMBERS_APART * (seed % 20)
    return Cases(given, first, {name: Selector(name, common) for name in SPARE})


def faster_paths(path: Path, folder: Path) -> Mapping[float, Path]:
    """Write the poses of a file at other speeds; return the files by factor.

    Raises:
        DikbenchError: if it is no file of poses, or a folder cannot be written.
    """
    poses = read_poses(str(path))
    files = {1.0: path}
    for factor in FASTER[1:]:
        file = folder / f"{path.stem}_{factor:g}_times_as_fast.csv"
        rows: list[Sequence[object]] = [("t", "x", "y", "z", "qx", "qy", "qz", "qw")]
        for time, placement in zip(poses.times, poses.placements, strict=True):
            turn = pin.Quaternion(placement.rotation)
            values = (*placement.translation, turn.x, turn.y, turn.z, turn.w)
            rows.append([repr(float(each)) for each in (time / factor, *values)])
        try:
            folder.mkdir(parents=True, exist_ok=True)
            with file.open("w", newline="", encoding="utf-8") as stream:
                csv.writer(stream).writerows(rows)
        except OSError as error:
            raise DikbenchError(f"file {file}: {error.strerror or error}") from None
        files[factor] = file
    return files
