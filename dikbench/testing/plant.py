"""The contract of plants, as checks for the author of one.

    @pytest.mark.parametrize("check", dikbench.testing.PLANT_CHECKS)
    def test_contract(check):
        check(MyPlant())

or, without pytest, `check_plant(MyPlant())`.
"""

from __future__ import annotations

import pickle
from collections.abc import Callable, Iterator
from dataclasses import is_dataclass
from typing import Final, NamedTuple

import numpy as np

from dikbench.arrays import Array, read_only
from dikbench.errors import in_words
from dikbench.robots.limits import Limits
from dikbench.scenario.plant import Plant
from dikbench.simulation.closed_loop import simulate
from dikbench.simulation.status import Status
from dikbench.solvers.checked_solve import make_solve
from dikbench.testing.motions import slow_line
from dikbench.testing.parameters import assert_ranges
from dikbench.testing.states import CONTROL_PERIOD_S, states
from dikbench.testing.straw import Reckless

COMMANDS: Final = (0.0, 0.5, 3.0)
"""Commands over the velocity limits of the joints."""

STATES: Final = 12

PlantCheck = Callable[[Plant], None]


class _Commanded(NamedTuple):
    label: str
    v: Array
    v_before: Array
    limits: Limits


def check_plant_declaration(plant: Plant) -> None:
    """Check that a plant is a frozen dataclass derived from `Plant`, its numbers with ranges."""
    name = type(plant).__name__
    frozen = getattr(getattr(plant, "__dataclass_params__", None), "frozen", False)
    if not isinstance(plant, Plant) or not is_dataclass(plant) or not frozen:
        raise AssertionError(
            f"{name} is not an instance of a class with @dataclass(frozen=True) that is derived "
            "from dikbench.scenario.Plant"
        )
    if type(plant).start is not Plant.start:
        raise AssertionError(
            f"{name} defines start(), which trials in lockstep do not ask; valid: drive and watch"
        )
    assert_ranges(plant)


def check_plant_drive(plant: Plant) -> None:
    """Check that what is applied of a command is an array of nv finite floats."""
    for case in _commanded():
        v = _driven(plant, case)
        if not isinstance(v, np.ndarray) or v.shape != case.v.shape or v.dtype != float:
            got = getattr(v, "shape", type(v).__name__)
            raise AssertionError(f"{case.label}: expected {case.v.shape} floats, got {got}")
        if not np.isfinite(v).all():
            raise AssertionError(f"{case.label}: not finite: {v.tolist()}")


def check_plant_inputs_untouched(plant: Plant) -> None:
    """Check that commands and limits stay as they are."""
    for case in _commanded():
        before = [np.array(part) for part in _inputs(case)]
        _driven(plant, case)
        for name, old, new in zip(NAMES, before, _inputs(case), strict=True):
            if not np.array_equal(old, new):
                raise AssertionError(f"{case.label}: the plant changed {name}")


def check_plant_repeatable(plant: Plant) -> None:
    """Check that the same command gives the same velocity to the bit, whatever came in between.

    What a plant remembers would be shared by the trials that run in lockstep.
    """
    cases = [*_commanded()]
    first = [np.array(_driven(plant, case)) for case in cases]
    for case, v in reversed([*zip(cases, first, strict=True)]):
        again = _driven(plant, case)
        if not np.array_equal(v, again):
            raise AssertionError(f"{case.label}: gave {v}, asked again {again}")


def check_plant_rows(plant: Plant) -> None:
    """Check that many commands at once, (N, nv), are each applied as if alone, to the bit."""
    groups: dict[tuple[int, bool], list[_Commanded]] = {}
    for case in _commanded():
        key = case.v.shape[-1], case.limits.joint.acceleration is None
        groups.setdefault(key, []).append(case)
    for group in groups.values():
        first = group[0].limits
        coordinates = np.array([case.limits.coordinates for case in group])
        v = read_only(np.array([case.v for case in group]))
        v_before = read_only(np.array([case.v_before for case in group]))
        together = _Commanded(
            f"{group[0].label} and {len(group) - 1} others at once", v, v_before,
            Limits(first.joint, coordinates),
        )  # fmt: skip
        rows = _driven(plant, together)
        if np.shape(rows) != v.shape:
            raise AssertionError(f"{together.label}: expected {v.shape}, got {np.shape(rows)}")
        for case, row in zip(group, rows, strict=True):
            one = _driven(plant, case)
            if not np.array_equal(one, row):
                raise AssertionError(
                    f"{case.label}: alone gave {one}, as one of {len(group)} rows {row}: rows must "
                    "not meet (reduce over the last axis)"
                )


def check_plant_run(plant: Plant) -> None:
    """Check that a run with it ends as runs do: at its end, or stopped by the plant."""
    scenario = slow_line()
    try:
        run = simulate(scenario, Reckless(), make_solve(None, None), plant, "time", 0)
    except Exception as error:
        raise AssertionError(f"a run: raised {in_words(error)}") from error
    if run.status not in {Status.OK, Status.PROTECTIVE_STOP, Status.DIVERGED}:
        raise AssertionError(f"a run ended {run.status.value}: {run.message}")


def check_plant_picklable(plant: Plant) -> None:
    """Check that the plant can be pickled, and that the copy does the same."""
    try:
        copied = pickle.loads(pickle.dumps(plant))
    except Exception as error:
        raise AssertionError(
            f"{type(plant).__name__} cannot be pickled ({error}); workers are processes: define "
            "the class at the top of a module, with parameters that pickle"
        ) from error
    for case in _commanded():
        if not np.array_equal(_driven(plant, case), _driven(copied, case)):
            raise AssertionError(f"{case.label}: unpickled, it applies another velocity")


def _commanded() -> Iterator[_Commanded]:
    """Yield commands at states inside, at and outside limits, with and without acceleration."""
    found = [*states()]
    for number, (label, problem) in enumerate(found[:: max(1, len(found) // STATES)]):
        robot, random = problem.robot, np.random.default_rng(number)
        assert robot.limits.velocity is not None
        fastest = robot.limits.velocity.upper
        for share in COMMANDS:
            v = share * random.uniform(-1, 1, robot.nv) * fastest
            before = 0.5 * random.uniform(-1, 1, robot.nv) * fastest
            yield _Commanded(
                f"{label}, command {share:g} of the limits", read_only(v), read_only(before),
                problem.limits,
            )  # fmt: skip


def _driven(plant: Plant, case: _Commanded) -> Array:
    try:
        return plant.drive(case.v, case.v_before, case.limits, CONTROL_PERIOD_S)
    except Exception as error:
        raise AssertionError(f"{case.label}: raised {in_words(error)}") from error


NAMES: Final = (
    "v", "v_before", "limits.coordinates", "limits.joint.velocity", "limits.joint.velocity",
    "limits.joint.acceleration", "limits.joint.acceleration",
)  # fmt: skip


def _inputs(case: _Commanded) -> list[Array]:
    joint, nothing = case.limits.joint, np.empty(0)
    found = [case.v, case.v_before, case.limits.coordinates]
    for interval in (joint.velocity, joint.acceleration):
        found += [nothing, nothing] if interval is None else [interval.lower, interval.upper]
    return [nothing if part is None else part for part in found]


PLANT_CHECKS: Final[tuple[PlantCheck, ...]] = (
    check_plant_declaration,
    check_plant_drive,
    check_plant_inputs_untouched,
    check_plant_repeatable,
    check_plant_rows,
    check_plant_run,
    check_plant_picklable,
)
"""Every check of a plant: (plant) -> None."""


def check_plant(plant: Plant) -> None:
    """Run every check; the first one that fails raises `AssertionError`."""
    for check in PLANT_CHECKS:
        check(plant)
