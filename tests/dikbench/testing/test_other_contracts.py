"""The contracts of solvers, plants, robots and metrics: a sound one passes, a fault is named."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Annotated, Any, ClassVar

import numpy as np
import pytest

from dikbench.arrays import Array
from dikbench.metrics import Metric, Motion
from dikbench.parameters import Range
from dikbench.programs.quadratic_program import ProgramKind, QuadraticProgram
from dikbench.robots import CatalogueEntry, planar_arm
from dikbench.robots.catalogue import ROBOTS
from dikbench.robots.limits import Limits
from dikbench.scenario.plant import PLANTS, Plant
from dikbench.solvers import Answer, SolverLibrary, Workspace
from dikbench.solvers.catalogue.back_ends import parse_solver
from dikbench.solvers.interfaces.cold import ColdSolver
from dikbench.testing import check_metric, check_plant, check_robot, check_solver
from dikbench.testing.verdicts import (
    Verdict,
    verdicts_on_metric,
    verdicts_on_plant,
    verdicts_on_robot,
    verdicts_on_solver,
)

DAQP = ColdSolver(parse_solver("daqp"))


@dataclass(frozen=True)
class Sound(SolverLibrary):
    """daqp, as if it were another author's."""

    share: Annotated[float, Range(0.0, 1.0)] = 0.5
    programs: ClassVar[frozenset[ProgramKind]] = frozenset({"qp", "lp"})

    def solve(self, program: QuadraticProgram) -> Answer:
        """See `SolverLibrary`."""
        return DAQP(program)


@dataclass(frozen=True)
class Lies(Sound):
    """Claims what it has not."""

    def solve(self, program: QuadraticProgram) -> Answer:
        """See `SolverLibrary`."""
        answer = DAQP(program)
        return Answer(np.zeros(len(program.q)) if answer.x is None else 1.1 * answer.x, True)


@dataclass(frozen=True)
class ClaimsAll(Sound):
    """Claims an answer to what has none."""

    def solve(self, program: QuadraticProgram) -> Answer:
        """See `SolverLibrary`."""
        answer = DAQP(program)
        return answer if answer.claimed else Answer(np.zeros(len(program.q)), True)


@dataclass(frozen=True)
class Raises(Sound):
    """Raises where there are equalities."""

    def solve(self, program: QuadraticProgram) -> Answer:
        """See `SolverLibrary`."""
        if program.A is not None:
            raise ValueError("no equalities here")
        return DAQP(program)


@dataclass(frozen=True)
class Writes(Sound):
    """Writes into the cost."""

    def solve(self, program: QuadraticProgram) -> Answer:
        """See `SolverLibrary`."""
        answer = DAQP(program)
        program.q[:] = 0.0
        return answer


@dataclass(frozen=True)
class Reuses(Sound):
    """Returns one array again and again."""

    kept: ClassVar[dict[int, Array]] = {}

    def solve(self, program: QuadraticProgram) -> Answer:
        """See `SolverLibrary`."""
        answer = DAQP(program)
        if answer.x is None:
            return answer
        x = self.kept.setdefault(len(program.q), np.zeros(len(program.q)))
        x[:] = answer.x
        return Answer(x, answer.claimed, answer.y, answer.z, answer.z_box)


@dataclass(frozen=True)
class Stale(Sound):
    """Has a workspace that keeps its first answer."""

    def workspace(self, program: QuadraticProgram) -> Workspace:
        """See `SolverLibrary`."""
        return _First()


class _First:
    answer: Answer | None = None

    def solve(self, program: QuadraticProgram) -> Answer:
        self.answer = self.answer or DAQP(program)
        return self.answer


@dataclass(frozen=True)
class Loose(Sound):
    """Has presets that change nothing of what it is: a rough answer."""

    def solve(self, program: QuadraticProgram) -> Answer:
        """See `SolverLibrary`."""
        answer = DAQP(program)
        return answer if answer.x is None else Answer(answer.x + 1e-5, answer.claimed)

    @classmethod
    def preset(cls, tolerance: float) -> dict[str, Any]:
        """See `SolverLibrary`."""
        return {"share": 0.1}


@dataclass(frozen=True)
class WrongPreset(Sound):
    """Has presets that name no setting."""

    @classmethod
    def preset(cls, tolerance: float) -> dict[str, Any]:
        """See `SolverLibrary`."""
        return {"eps": tolerance}


@dataclass(frozen=True)
class Unranged(Sound):
    """Has a number without a range."""

    eps: float = 1e-6


def broken(verdicts: Any) -> set[str]:
    """The checks that are broken; each has a reason in one line."""
    found: list[Verdict] = [each for each in verdicts if each.outcome == "BROKEN"]
    assert all(each.reason and "\n" not in each.reason for each in found)
    return {each.check for each in found}


def of_library(library: SolverLibrary) -> set[str]:
    """The broken checks of a solver."""
    solver = parse_solver("daqp")
    return broken(verdicts_on_solver(replace(solver, name="theirs", library=library)))


def test_a_sound_solver_passes() -> None:
    """Of another author, and the shipped ones that are exact."""
    check_solver(Sound())
    check_solver(parse_solver("daqp"))


@pytest.mark.parametrize(
    ("solver", "expected"),
    [
        (Lies(), {"answers", "linear programs", "infeasible"}),
        (ClaimsAll(), {"infeasible"}),
        (Raises(), {"answers", "linear programs"}),
        (Writes(), {"answers", "inputs untouched", "repeatable"}),
        (Reuses(), {"repeatable"}),
        (Stale(), {"warm"}),
        (Loose(), {"presets"}),
        (WrongPreset(), {"presets"}),
        (Unranged(), {"declaration"}),
    ],
    ids=lambda value: type(value).__name__ if isinstance(value, SolverLibrary) else "",
)
def test_a_fault_of_a_solver_is_named(solver: SolverLibrary, expected: set[str]) -> None:
    """By the check of its kind."""
    found = of_library(solver)
    assert found
    assert found <= expected | {"presets", "linear programs"}
    assert found & expected


def test_the_shipped_plants_and_robots_keep_their_contracts() -> None:
    """Every plant; the robots that are built in code, and one of the data package."""
    for plant in PLANTS.values():
        check_plant(plant())
    for name in ("planar1r", "planar3r", "planar4r", "base", "lwr", "ur5"):
        check_robot(ROBOTS[name])


@dataclass(frozen=True)
class Through(Plant):
    """Applies the command: what the faulty plants change."""

    def drive(self, v: Array, v_before: Array, limits: Limits, dt: float) -> Array:
        """See `Plant`."""
        return v


def _plant(drive: Callable[[Array, Array], Any], **more: Any) -> Plant:
    kind = type(
        "Faulty", (Through,), {"drive": lambda _, v, before, *rest: drive(v, before), **more}
    )
    kind.__module__ = __name__
    globals()["Faulty"] = dataclass(frozen=True)(kind)
    made: Plant = globals()["Faulty"]()
    return made


COUNT: list[int] = []


def _counted(v: Array) -> Array:
    COUNT.append(1)
    return v * (1 - 1e-9 * len(COUNT))


def _written(v: Array, before: Array) -> Array:
    before.flags.writeable = True
    before *= 0.5
    return v


@pytest.mark.parametrize(
    ("drive", "expected"),
    [
        (lambda v, before: v[..., :-1], "drive"),
        (lambda v, before: v / np.zeros_like(v) if v.any() else v, "drive"),
        (lambda v, before: v.tolist(), "drive"),
        (lambda v, before: 1 / 0, "drive"),
        (_written, "inputs untouched"),
        (lambda v, before: _counted(v), "repeatable"),
        (lambda v, before: v / max(1.0, float(np.abs(v).max())), "rows"),
    ],
)
@pytest.mark.filterwarnings("ignore::RuntimeWarning")
def test_a_fault_of_a_plant_is_named(drive: Callable[[Array, Array], Any], expected: str) -> None:
    """Shape, what is not finite, what raises, mutation, memory, rows that meet."""
    assert expected in broken(verdicts_on_plant(_plant(drive)))


ARM = CatalogueEntry(
    "an arm", lambda: planar_arm((0.5, 0.4, 0.3), velocity_limits=(1.0,) * 3), "tip",
    (0.3, 1.0, 0.5), (1.0,) * 3, "chosen", task_rows=(0, 1, 5),
)  # fmt: skip
LENGTHS = iter(range(1, 100))


def longer() -> Any:
    """Build another arm each time."""
    return planar_arm((0.5, 0.4, 0.1 * next(LENGTHS)), velocity_limits=(1.0,) * 3)


@pytest.mark.parametrize(
    ("entry", "expected"),
    [
        (replace(ARM, summary=""), {"declaration"}),
        (replace(ARM, start=(0.3,)), {"model"}),
        (replace(ARM, start=(9.0, 0.0, 0.0)), {"start"}),
        (replace(ARM, frame="nowhere"), {"model"}),
        (replace(ARM, acceleration=(1.0, -1.0, 1.0)), {"model"}),
        (replace(ARM, task_rows=(0, 1, 2)), {"rows"}),
        (
            replace(ARM, model=lambda: longer()),
            {"repeatable"},
        ),
        (replace(ARM, model=lambda: 1 / 0), {"model"}),
    ],
)
def test_a_fault_of_a_robot_is_named(entry: CatalogueEntry, expected: set[str]) -> None:
    """By the first check that meets it; one cause is named once."""
    assert broken(verdicts_on_robot(entry)) == expected


def test_a_sound_robot_passes() -> None:
    """The one from which the faulty ones are made."""
    check_robot(ARM)


def _metric(of: Callable[[Motion], Any], **changes: Any) -> Metric:
    known = {"name": "mine", "unit": "", "best": "low", "worst": float("inf"), "definition": "it"}
    return Metric(**{**known, **changes, "of": of})


def _speed(motion: Motion) -> float:
    return float(np.abs(motion.trace.applied).max())


def test_a_sound_metric_passes() -> None:
    """A metric, and a tuple of some; NaN is a value."""
    check_metric(_metric(_speed))
    check_metric((_metric(_speed), _metric(lambda motion: float("nan"), name="other")))


@pytest.mark.parametrize(
    ("metric", "expected"),
    [
        (_metric(_speed, name="position_error_max_m"), {"declaration"}),
        (_metric(_speed, unit="rad/s"), {"declaration"}),
        (_metric(_speed, definition="two\nlines"), {"declaration"}),
        (_metric(lambda motion: "fast"), {"value"}),
        (_metric(lambda motion: 1 / 0), {"value"}),
        (_metric(_speed, worst=0.0), {"worst"}),
        (_metric(lambda motion: _counted(np.ones(1))[0]), {"repeatable"}),
    ],
)
def test_a_fault_of_a_metric_is_named(metric: Metric, expected: set[str]) -> None:
    """By the check of its kind."""
    assert expected <= broken(verdicts_on_metric(metric))
