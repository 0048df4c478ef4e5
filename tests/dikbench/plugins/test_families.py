"""Families of other projects, in tables and in files, and the errors of wrong ones."""

from __future__ import annotations

from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from makers.plugins import Install
from makers.scenarios import error_of

from dikbench.plugins.building import make_scenario
from dikbench.plugins.finding import scenario_plugin
from dikbench.scenario import Family, Perturbation, Robot
from formulations.damped_least_squares import DampedLeastSquares
from scenarios.reach import Reach

FAMILY = """
from dataclasses import dataclass
from dikbench.scenario import Case, Family

{decorator}
class Mine(Family):
    {field}
    def case(self, robot, change):
        return {case}
"""


def _family(tmp_path: Path, field: str, case: str = "None", decorator: str = "") -> str:
    path = tmp_path / f"family_{len(list(tmp_path.iterdir()))}.py"
    decorator = decorator or "@dataclass(frozen=True, kw_only=True)"
    path.write_text(FAMILY.format(decorator=decorator, field=field, case=case))
    return f"{path}:Mine"


def test_what_a_family_does_wrong_is_one_line_with_its_selector(tmp_path: Path) -> None:
    """An exception of its own, a case that is none, a class that was not meant so."""
    selector = _family(tmp_path, "", "1 / 0")
    assert error_of(make_scenario, selector) == (
        f"scenario {selector}: ZeroDivisionError: division by zero "
        f"({Path(selector.partition(':')[0]).name}, line 9)"
    )
    selector = _family(tmp_path, "", "None")
    assert error_of(make_scenario, selector).startswith(f"scenario {selector}: case() returned")
    selector = _family(tmp_path, "length: float = 1.0", decorator="# none")
    message = error_of(make_scenario, selector)
    assert message.endswith("scenario 'Mine': class Mine: write @dataclass(frozen=True) above it")
    selector = _family(tmp_path, "dt = 0.005")
    message = error_of(make_scenario, selector)
    assert "cannot be imported" in message
    assert "dt = 0.005 has no type" in message


def test_a_family_from_a_file(tmp_path: Path) -> None:
    """`path/to/file.py:Class`, with parameters; what is not there is named with its neighbours."""
    selector = _family(tmp_path, "length: float = 1.0")
    plugin = scenario_plugin(selector)
    assert plugin.parameters["length"].default == 1.0
    assert plugin.file == selector.rpartition(":")[0]
    assert "did you mean 'length'?" in error_of(make_scenario, f"{selector}[lenght=2]")
    assert "valid: Mine" in error_of(make_scenario, selector.replace(":Mine", ":Mien"))
    missing = f"{tmp_path}/none.py"
    assert error_of(make_scenario, f"{missing}:Mine").startswith(f"file not found: {missing}")


def test_a_family_without_a_variation_takes_seeds(tmp_path: Path) -> None:
    """A seed that changes nothing of the scenario still draws the noise of a plant."""
    selector = _family(
        tmp_path,
        "",
        "Case(target_at_rest(placement_of(robot, robot.q0), 1.0), robot.q0, None, ())",
    )
    path = Path(selector.rpartition(":")[0])
    names = "Case, Family, placement_of, target_at_rest"
    path.write_text(path.read_text().replace("Case, Family", names, 1))
    first, second = make_scenario(selector, 0), make_scenario(selector, 1)
    assert (first.q0 == second.q0).all()
    assert "seed -1 must not be negative" in error_of(make_scenario, selector, -1)


def _reach(robot: str = "planar3r", seed: int = 0) -> object:
    """A function that gives a scenario."""
    return Reach(robot=robot).scenario(seed)


@pytest.mark.parametrize(
    ("entry", "words"),
    [
        (_reach, "scenario 'theirs' is no class, nor an instance of one"),
        (partial(_reach, "ur5"), "scenario 'theirs' is no class, nor an instance of one"),
        (dict, "scenario 'theirs' is not derived from dikbench.scenario.Family"),
        (DampedLeastSquares(), "scenario 'theirs' is not derived from dikbench.scenario.Family"),
    ],
)
def test_a_family_is_a_class_derived_from_family(
    install: Install, entry: object, words: str
) -> None:
    """Nothing else makes scenarios: the message says what is missing, and in which file."""
    install("dikbench.scenarios", theirs={"theirs": entry})
    assert error_of(make_scenario, "theirs") == f"/somewhere/theirs.py: {words}"


def test_a_family_that_does_not_make_a_scenario_is_named(install: Install) -> None:
    """With the selector and what went wrong."""
    install("dikbench.scenarios", theirs={"empty": Empty})
    message = error_of(make_scenario, "empty")
    assert message.startswith("scenario empty: case() returned NoneType; valid: a dikbench.")


@dataclass(frozen=True, kw_only=True)
class Empty(Family):
    """A family without a case."""

    def case(self, robot: Robot, change: Perturbation) -> Any:
        """See `Family`."""
        return None


def test_a_family_with_other_defaults_keeps_ranges_and_seeds(install: Install) -> None:
    """What the base declares of a parameter holds for a new default too; other seeds differ."""
    install("dikbench.scenarios", theirs={"near": Near})
    scenario = make_scenario("near[acceleration=true]")
    assert scenario.robot.limits.acceleration is not None
    assert scenario.robot.name == "planar3r"
    assert np.array_equal(scenario.q0, make_scenario("near", 0).q0)
    assert not np.array_equal(scenario.q0, make_scenario("near", 1).q0)
    assert "distance='far' is not valid" in error_of(make_scenario, "near[distance=far]")
    assert "distance=1.0 must be 0.01 to 0.3" in error_of(make_scenario, "near[distance=1]")


@dataclass(frozen=True, kw_only=True)
class Near(Reach):
    """Reach with other defaults."""

    robot: str = "planar3r"
    distance: float = 0.05


def test_a_default_without_a_type_is_refused() -> None:
    """Python would make it no parameter: the message says what to write."""

    def define() -> object:
        return type("Bare", (Reach,), {"distance": 0.05})

    message = error_of(define)
    assert "distance = 0.05 has no type" in message
    assert "write distance: float = 0.05" in message
