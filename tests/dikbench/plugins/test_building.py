"""Plug-ins by name and from a file: their parameters, and what is said where they are wrong."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest
from makers.plugins import law_with
from makers.scenarios import error_of

from dikbench.plugins.building import (
    make_family,
    make_formulation,
    make_scenario,
    scenario_parameters,
)
from dikbench.plugins.finding import formulation_plugin, plugins
from formulations.damped_least_squares import DampedLeastSquares
from formulations.pseudo_inverse import PseudoInverse

LAW = '''"""A law of a user."""
from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar, Literal

import numpy as np

from dikbench.arrays import Array
from dikbench.problem import DikProblem, ProgramKind, Solve


@dataclass(frozen=True)
class Mine:
    """My own law: stands still.

    Source: nobody 2026.
    """

    gain: float = 1.0
    count: int = 3
    careful: bool = False
    side: Literal["left", "right"] = "left"

    program: ClassVar[ProgramKind] = "qp"

    def velocity(self, problem: DikProblem, solve: Solve) -> Array:
        """See `Formulation`."""
        return np.zeros(problem.robot.nv)


class NotALaw:
    """No velocity here."""
'''


@pytest.fixture
def law_file(tmp_path: Path) -> Path:
    """A file with a law, as a user writes it."""
    path = tmp_path / "mine.py"
    path.write_text(LAW)
    return path


# --- names, parameters and their types


def test_the_own_plugins_are_registered_through_entry_points() -> None:
    """The names of the first vertical slice, each with a summary, a source and its own file."""
    laws, families = plugins("formulation"), plugins("scenario")
    assert {"pinv", "dls", "nullspace", "qp", "lp-alpha", "lp-alpha-cvxpy"} <= set(laws)
    assert {"reach", "near-miss", "joint-limit-crossing", "speed-sweep"} <= set(families)
    assert laws["dls"].file.endswith("formulations/damped_least_squares.py")
    assert families["near-miss"].file.endswith("scenarios/near_miss.py")
    for plugin in (*laws.values(), *families.values()):
        assert plugin.summary, plugin.name


def test_parameters_arrive_in_their_types() -> None:
    """Numbers, choices, truth values and None, as the class declares them."""
    assert make_formulation("dls[damping=0.125]") == DampedLeastSquares(damping=0.125)
    assert make_formulation("pinv[after=clip,rank_tolerance=1e-3]") == PseudoInverse("clip", 1e-3)
    assert make_formulation("pinv") == PseudoInverse()
    qp: Any = make_formulation("qp[log_derivative=true]")
    assert qp.log_derivative is True
    alpha: Any = make_formulation("lp-alpha[regularization=null]")
    assert alpha.regularization is None
    scenario = make_scenario("reach[robot=ur5,dt=0.02,acceleration=true]")
    assert (scenario.robot.name, scenario.dt) == ("ur5", 0.02)
    assert scenario.robot.limits.acceleration is not None


@pytest.mark.parametrize(
    ("text", "parts"),
    [
        ("dsl", ["unknown formulation 'dsl'", "did you mean 'dls'?", "valid:", "path/to/file.py"]),
        ("dls[dampign=1]", ["parameter of formulation dls 'dampign'", "did you mean 'damping'?"]),
        (
            "dls[damping=much]",
            ["formulation dls: damping='much' is not valid", "valid: a number, finite"],
        ),
        ("dls[damping=-1]", ["dls: damping=-1.0 must be finite and at least 0"]),
        ("dls[damping=nan]", ["dls: damping=nan must be finite and at least 0"]),
        ("pinv[after=cilp]", ["pinv: after='cilp' is not valid", "valid: none, clip, scale"]),
        ("qp[braking=x]", ["valid: one-step, gain, sqrt, viable"]),
        ("qp[log_derivative=maybe]", ["log_derivative='maybe' is not valid", "true or false"]),
    ],
)
def test_wrong_formulations_name_what_would_be_valid(text: str, parts: list[str]) -> None:
    """One line: what was wrong, where, and the nearest match or the choices."""
    message = error_of(make_formulation, text)
    for part in parts:
        assert part in message


@pytest.mark.parametrize(
    ("text", "parts"),
    [
        ("near-mis", ["unknown scenario 'near-mis'", "did you mean 'near-miss'?", "valid:"]),
        ("near-miss[mis=1]", ["parameter of scenario near-miss 'mis'", "did you mean 'miss'?"]),
        ("near-miss[miss=far]", ["near-miss: miss='far' is not valid"]),
        ("near-miss[robot=iiwa]", ["unknown robot 'iiwa'", "panda", "or give the path of a .urdf"]),
        ("reach[robot=pnada]", ["unknown robot 'pnada'", "did you mean 'panda'?"]),
        ("reach[seed=3]", ["the seed is not a parameter"]),
        ("reach[dt=0]", ["scenario reach: dt=0.0 must be finite and above 0"]),
    ],
)
def test_wrong_scenarios_name_what_would_be_valid(text: str, parts: list[str]) -> None:
    """One line: what was wrong, where, and the nearest match or the choices."""
    message = error_of(make_scenario, text)
    for part in parts:
        assert part in message


def test_the_seed_is_not_offered_as_a_parameter() -> None:
    """It comes from the study, so that it is no suggestion for a typing error either."""
    assert "seed" not in error_of(make_scenario, "reach[sead=3]").partition("valid:")[2]


# --- a law in a file


def test_a_law_from_a_file(law_file: Path) -> None:
    """`path/to/file.py:Class`, with postponed annotations, a frozen dataclass and parameters."""
    plain: Any = make_formulation(f"{law_file}:Mine")
    assert (plain.gain, plain.count, plain.careful, plain.side) == (1.0, 3, False, "left")
    law: Any = make_formulation(f"{law_file}:Mine[gain=0.5,count=7,careful=true,side=right]")
    assert (law.gain, law.count, law.careful, law.side) == (0.5, 7, True, "right")
    plugin = formulation_plugin(f"{law_file}:Mine")
    assert plugin.file == str(law_file)
    assert plugin.summary == "My own law: stands still."
    assert plugin.source == "nobody 2026"


@pytest.mark.parametrize(
    ("selector", "parts"),
    [
        ("{file}:Mien", ["unknown class 'Mien' in {file}", "did you mean 'Mine'?"]),
        ("{file}:NotALaw", ["{file}: formulation 'NotALaw' has no method velocity"]),
        ("{file}:Mine[side=up]", ["side='up' is not valid; valid: left, right"]),
        ("{file}:Mine[size=1]", ["'size'", "valid: careful, count, gain, side"]),
        ("{file}:", ["unknown class ''"]),
        ("{folder}/other.py:Mine", ["file not found: {folder}/other.py; valid: path/to/"]),
        ("{folder}:Mine", ["unknown formulation"]),
        ("{long}.py:Mine", ["file not found"]),
    ],
)
def test_errors_of_a_law_in_a_file(law_file: Path, selector: str, parts: list[str]) -> None:
    """The file is named, and what there is in it."""
    values = {"file": law_file, "folder": law_file.parent, "long": "x" * 300}
    message = error_of(make_formulation, selector.format(**values))
    for part in parts:
        assert part.format(**values) in message


@pytest.mark.parametrize(
    ("text", "reason"),
    [
        ("import nothing_of_this_name", "ModuleNotFoundError: No module named 'nothing_of_"),
        ("def broken(:", "SyntaxError"),
        ("1 / 0", "ZeroDivisionError: division by zero"),
    ],
)
def test_a_file_that_cannot_be_imported_is_named(tmp_path: Path, text: str, reason: str) -> None:
    """With the reason that Python gives, and no traceback."""
    path = tmp_path / "broken.py"
    path.write_text(text)
    message = error_of(make_formulation, f"{path}:Law")
    assert message.startswith(f"{path} cannot be imported: {reason}")


def test_a_parameter_keeps_its_type_where_another_cannot_be_resolved(tmp_path: Path) -> None:
    """A name imported for type checkers only must not turn every number into a text."""
    selector = law_with(
        tmp_path,
        "gain: float = 1.0\n    careful: bool = False\n    target: Array | None = None",
        "from typing import TYPE_CHECKING\nif TYPE_CHECKING:\n from dikbench.arrays import Array",
    )
    law: Any = make_formulation(f"{selector}[gain=0.5,careful=true]")
    assert law.gain == 0.5
    assert law.careful is True
    message = error_of(make_formulation, f"{selector}[gain=much]")
    assert "gain='much' is not valid" in message


def test_an_inherited_parameter_keeps_the_type_of_its_base(tmp_path: Path) -> None:
    """Whose annotations mean something in the base's own file only."""
    path = tmp_path / "slower.py"
    path.write_text(
        "from dataclasses import dataclass\n"
        "from formulations.pseudo_inverse import PseudoInverse\n"
        "@dataclass(frozen=True)\n"
        "class Slower(PseudoInverse):\n"
        "    factor: float = 0.5\n"
    )
    law: Any = make_formulation(f"{path}:Slower[after=clip,rank_tolerance=0.25,factor=0.1]")
    assert (law.after, law.rank_tolerance, law.factor) == ("clip", 0.25, 0.1)
    message = error_of(make_formulation, f"{path}:Slower[after=cilp]")
    assert "valid: none, clip, scale" in message


def test_a_parameter_that_no_text_can_give_is_an_error(tmp_path: Path) -> None:
    """An array or a function has no form in a selector."""
    selector = law_with(
        tmp_path, "weight: float | Array = 1.0", "from dikbench.arrays import Array"
    )
    assert "weight='2' is not valid" in error_of(make_formulation, f"{selector}[weight=2]")
    assert make_formulation(selector) is not None


def test_a_required_parameter_must_be_given(tmp_path: Path) -> None:
    """The message names it; given, it arrives."""
    selector = law_with(tmp_path, "gain: float")
    assert "parameter 'gain' must be given" in error_of(make_formulation, selector)
    law: Any = make_formulation(f"{selector}[gain=2]")
    assert law.gain == 2.0


def test_a_law_that_refuses_its_parameters_is_an_error_of_one_line(tmp_path: Path) -> None:
    """Whatever it raises: the message names the law and carries the reason."""
    selector = law_with(
        tmp_path,
        "gain: float = 1.0\n"
        "    def __post_init__(self):\n"
        "        if self.gain < 0: raise ValueError('gain must not be negative')",
    )
    message = error_of(make_formulation, f"{selector}[gain=-1]")
    assert "Law" in message
    assert "gain must not be negative" in message


def test_ranges_of_a_law_without_a_base_are_checked(tmp_path: Path) -> None:
    """A plain frozen dataclass may have ranges in its annotations; a selector is held to them."""
    selector = law_with(
        tmp_path,
        "gain: Annotated[float, Range(0.0, 2.0, '1/s')] = 1.0",
        "from typing import Annotated\nfrom dikbench.problem import Range",
    )
    law: Any = make_formulation(f"{selector}[gain=2]")
    assert law.gain == 2.0
    for value in ("3", "nan", "-1"):
        message = error_of(make_formulation, f"{selector}[gain={value}]")
        assert message == f"formulation Law: gain={float(value)} must be 0 to 2 [1/s]"


def test_a_parameter_with_one_value_is_not_offered() -> None:
    """A family that fixes its frame says so where one is given, and lists it nowhere."""
    assert make_scenario("greedy-trap[robot=planar1r]").robot.name == "planar1r"
    assert "frame='tool0' is not valid" in error_of(make_scenario, "hexagon[frame=tool0]")
    assert "frame" not in error_of(make_scenario, "hexagon[frme=tool0]").partition("valid:")[2]


def test_the_values_of_a_selector_s_parameters() -> None:
    """Given ones and defaults, in their types; the seed is none of them."""
    values = scenario_parameters("near-miss[miss=0,robot=panda]")
    assert values["miss"] == 0.0
    assert isinstance(values["miss"], float)
    assert (values["robot"], values["dt"], values["singularity"]) == ("panda", 0.005, "auto")
    assert "seed" not in values
    assert make_family("reach") == make_family("reach[distance=0.1]")
