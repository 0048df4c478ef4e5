"""Plug-ins: how they are found, checked and built, and what is said where they are wrong."""

from __future__ import annotations

import importlib.metadata
from collections.abc import Callable, Iterator, Mapping
from functools import partial
from pathlib import Path
from types import ModuleType
from typing import Any

import pytest

from dikbench.errors import DikbenchError
from dikbench.registry import (
    formulation_plugin,
    make_formulation,
    make_scenario,
    plugins,
    scenario_plugin,
)
from formulations.damped_least_squares import DampedLeastSquares
from formulations.pseudo_inverse import PseudoInverse
from scenarios.reach import reach

LAW = '''"""A law of a user."""
from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar, Literal

import numpy as np

from dikbench.array import Array
from dikbench.problem import DikProblem, Program, Solve


@dataclass(frozen=True)
class Mine:
    """My own law: stands still.

    Source: nobody 2026.
    """

    gain: float = 1.0
    count: int = 3
    careful: bool = False
    side: Literal["left", "right"] = "left"

    program: ClassVar[Program] = "qp"

    def velocity(self, problem: DikProblem, solve: Solve) -> Array:
        """See `Formulation`."""
        return np.zeros(problem.robot.nv)


class NotALaw:
    """No velocity here."""
'''


class _EntryPoint:
    """An entry point whose module is made on the spot."""

    def __init__(self, name: str, load: Callable[[], ModuleType]) -> None:
        self.name = name
        self.value = f"{name}_module"
        self.load = load


Install = Callable[..., None]


@pytest.fixture
def install(monkeypatch: pytest.MonkeyPatch) -> Iterator[Install]:
    """Replace every registered plug-in; each argument is a module, a table or a loader."""

    def replace_all(group: str, **entries: Any) -> None:
        points = []
        for name, entry in entries.items():
            if isinstance(entry, ModuleType):
                points.append(_EntryPoint(name, lambda module=entry: module))
            elif callable(entry):
                points.append(_EntryPoint(name, entry))
            else:
                module = ModuleType(name)
                module.__file__ = f"/somewhere/{name}.py"
                setattr(module, group.removeprefix("dikbench.").upper(), entry)
                points.append(_EntryPoint(name, lambda module=module: module))
        known = {group: points}
        monkeypatch.setattr(
            importlib.metadata, "entry_points", lambda *, group: known.get(group, [])
        )
        plugins.cache_clear()

    yield replace_all
    monkeypatch.undo()
    plugins.cache_clear()


def _laws(**table: Any) -> Mapping[str, Any]:
    return {name.replace("_", "-"): build for name, build in table.items()}


@pytest.fixture
def law_file(tmp_path: Path) -> Path:
    """A file with a law, as a user writes it."""
    path = tmp_path / "mine.py"
    path.write_text(LAW)
    return path


def _message(call: Callable[..., object], *args: object) -> str:
    with pytest.raises(DikbenchError) as caught:
        call(*args)
    assert "\n" not in str(caught.value)
    return str(caught.value)


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
        ("dls[damping=much]", ["formulation dls: damping='much' is not valid", "float"]),
        ("dls[damping=-1]", ["dls: damping must be finite and at least 0"]),
        ("dls[damping=nan]", ["dls: damping must be finite and at least 0"]),
        ("pinv[after=cilp]", ["pinv: after='cilp' is not valid", "valid: none, clip, scale"]),
        ("qp[braking=x]", ["valid: one-step, gain, sqrt, viable"]),
        ("qp[log_derivative=maybe]", ["log_derivative='maybe' is not valid", "bool"]),
    ],
)
def test_wrong_formulations_name_what_would_be_valid(text: str, parts: list[str]) -> None:
    """One line: what was wrong, where, and the nearest match or the choices."""
    message = _message(make_formulation, text)
    for part in parts:
        assert part in message


@pytest.mark.parametrize(
    ("text", "parts"),
    [
        ("near-mis", ["unknown scenario 'near-mis'", "did you mean 'near-miss'?", "speed-sweep"]),
        ("near-miss[mis=1]", ["parameter of scenario near-miss 'mis'", "did you mean 'miss'?"]),
        ("near-miss[miss=far]", ["near-miss: miss='far' is not valid"]),
        ("near-miss[robot=iiwa]", ["robot='iiwa' is not valid", "valid: ur5, ur10, panda"]),
        ("reach[robot=pnada]", ["unknown robot 'pnada'", "did you mean 'panda'?"]),
        ("reach[seed=3]", ["the seed is not a parameter"]),
        ("reach[dt=0]", ["scenario reach: dt=0.0 must be positive and finite"]),
    ],
)
def test_wrong_scenarios_name_what_would_be_valid(text: str, parts: list[str]) -> None:
    """One line: what was wrong, where, and the nearest match or the choices."""
    message = _message(make_scenario, text)
    for part in parts:
        assert part in message


def test_the_seed_is_not_offered_as_a_parameter() -> None:
    """It comes from the study, so that it is no suggestion for a typing error either."""
    assert "seed" not in _message(make_scenario, "reach[sead=3]").partition("valid:")[2]


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
        ("{file}:Mine[side=up]", ["side='up' is not valid: valid: left, right"]),
        ("{file}:Mine[size=1]", ["'size'", "valid: careful, count, gain, side"]),
        ("{file}:", ["unknown class ''"]),
        ("{folder}/other.py:Mine", ["formulation file not found: {folder}/other.py"]),
        ("{folder}:Mine", ["unknown formulation"]),
        ("{long}.py:Mine", ["formulation file not found"]),
    ],
)
def test_errors_of_a_law_in_a_file(law_file: Path, selector: str, parts: list[str]) -> None:
    """The file is named, and what there is in it."""
    values = {"file": law_file, "folder": law_file.parent, "long": "x" * 300}
    message = _message(make_formulation, selector.format(**values))
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
    message = _message(make_formulation, f"{path}:Law")
    assert message.startswith(f"formulation file {path} cannot be imported: {reason}")


def _law_with(tmp_path: Path, fields: str, imports: str = "") -> str:
    path = tmp_path / "law.py"
    path.write_text(
        "from __future__ import annotations\n"
        "from dataclasses import dataclass\n"
        f"{imports}\n"
        "@dataclass(frozen=True)\n"
        "class Law:\n"
        f"    {fields}\n"
        "    def velocity(self, problem, solve):\n"
        "        return None\n"
    )
    return f"{path}:Law"


def test_a_parameter_keeps_its_type_where_another_cannot_be_resolved(tmp_path: Path) -> None:
    """A name imported for type checkers only must not turn every number into a text."""
    selector = _law_with(
        tmp_path,
        "gain: float = 1.0\n    careful: bool = False\n    target: Array | None = None",
        "from typing import TYPE_CHECKING\nif TYPE_CHECKING:\n    from dikbench.array import Array",
    )
    law: Any = make_formulation(f"{selector}[gain=0.5,careful=true]")
    assert law.gain == 0.5
    assert law.careful is True
    message = _message(make_formulation, f"{selector}[gain=much]")
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
    message = _message(make_formulation, f"{path}:Slower[after=cilp]")
    assert "valid: none, clip, scale" in message


def test_a_parameter_that_no_text_can_give_is_an_error(tmp_path: Path) -> None:
    """An array or a function has no form in a selector."""
    selector = _law_with(
        tmp_path, "weight: float | Array = 1.0", "from dikbench.array import Array"
    )
    assert "weight='2' is not valid" in _message(make_formulation, f"{selector}[weight=2]")
    assert make_formulation(selector) is not None


def test_a_required_parameter_must_be_given(tmp_path: Path) -> None:
    """The message names it; given, it arrives."""
    selector = _law_with(tmp_path, "gain: float")
    assert "parameter 'gain' must be given" in _message(make_formulation, selector)
    law: Any = make_formulation(f"{selector}[gain=2]")
    assert law.gain == 2.0


def test_a_law_that_refuses_its_parameters_is_an_error_of_one_line(tmp_path: Path) -> None:
    """Whatever it raises: the message names the law and carries the reason."""
    selector = _law_with(
        tmp_path,
        "gain: float = 1.0\n"
        "    def __post_init__(self):\n"
        "        if self.gain < 0: raise ValueError('gain must not be negative')",
    )
    message = _message(make_formulation, f"{selector}[gain=-1]")
    assert "Law" in message
    assert "gain must not be negative" in message


# --- tables of other projects


def test_a_table_of_another_project_is_found(install: Install) -> None:
    """Two lines in its own project: an entry point and a mapping."""
    install("dikbench.formulations", theirs=_laws(their_dls=DampedLeastSquares))
    assert set(plugins("formulation")) == {"their-dls"}
    assert make_formulation("their-dls[damping=0.5]") == DampedLeastSquares(0.5)


def test_a_table_may_hold_a_law_with_its_parameters_set(install: Install) -> None:
    """An instance: its values are the defaults, a selector still replaces them."""
    install("dikbench.formulations", theirs=_laws(soft=DampedLeastSquares(damping=0.2)))
    assert make_formulation("soft") == DampedLeastSquares(0.2)
    assert make_formulation("soft[damping=0.3]") == DampedLeastSquares(0.3)
    assert plugins("formulation")["soft"].parameters["damping"].default == 0.2
    assert "did you mean 'damping'?" in _message(make_formulation, "soft[dampin=1]")


def test_the_parameters_that_an_instance_has_need_not_be_given(
    install: Install, tmp_path: Path
) -> None:
    """Also where the class itself has no default for them."""
    law: Any = make_formulation(_law_with(tmp_path, "gain: float") + "[gain=2]")
    install("dikbench.formulations", theirs=_laws(ready=law))
    assert make_formulation("ready") == law


def test_a_table_may_hold_partial_calls(install: Install) -> None:
    """functools.partial sets parameters of a family or a class as one would expect."""
    install("dikbench.scenarios", theirs={"ur5-reach": partial(reach, robot="ur5", dt=0.05)})
    scenario = make_scenario("ur5-reach[dt=0.02]", seed=1)
    assert (scenario.robot.name, scenario.dt) == ("ur5", 0.02)
    assert make_scenario("ur5-reach").dt == 0.05
    assert scenario_plugin("ur5-reach").summary == plugins("scenario")["ur5-reach"].summary != ""
    install("dikbench.formulations", theirs=_laws(soft=partial(DampedLeastSquares, damping=0.2)))
    assert make_formulation("soft") == DampedLeastSquares(0.2)
    assert make_formulation("soft[damping=0.3]") == DampedLeastSquares(0.3)


def test_two_plugins_of_one_name_are_an_error_that_names_both_files(install: Install) -> None:
    """Neither wins silently."""
    install(
        "dikbench.formulations",
        ours=_laws(dls=DampedLeastSquares),
        theirs=_laws(dls=PseudoInverse),
    )
    message = _message(make_formulation, "dls")
    assert message.startswith("two plug-ins are called 'dls'")
    assert "damped_least_squares.py" in message
    assert "pseudo_inverse.py" in message


@pytest.mark.parametrize("build", [DampedLeastSquares, DampedLeastSquares(0.2)])
def test_the_same_plugin_twice_is_no_conflict(install: Install, build: object) -> None:
    """One table that is named by two entry points (an editable install beside an old one)."""
    table = _laws(dls=build)
    install("dikbench.formulations", ours=table, again=table)
    assert set(plugins("formulation")) == {"dls"}


def test_a_module_without_a_table_is_named(install: Install) -> None:
    """PyPI has unrelated packages of the same names: the file tells which one was loaded."""
    module = ModuleType("formulations")
    module.__file__ = "/elsewhere/formulations/__init__.py"
    install("dikbench.formulations", builtin=module)
    assert _message(make_formulation, "dls") == (
        "plug-in 'builtin' of dikbench.formulations: /elsewhere/formulations/__init__.py holds no "
        "mapping FORMULATIONS"
    )


def test_a_table_of_the_wrong_type_is_named(install: Install) -> None:
    """A list is no mapping."""
    module = ModuleType("theirs")
    module.FORMULATIONS = [DampedLeastSquares]  # type: ignore[attr-defined]
    install("dikbench.formulations", theirs=module)
    assert "holds no mapping FORMULATIONS" in _message(make_formulation, "dls")


def test_a_plugin_that_cannot_be_imported_is_named(install: Install) -> None:
    """With the entry point, its module and the reason."""

    def load() -> ModuleType:
        raise ImportError("no module named theirs")

    install("dikbench.scenarios", theirs=load)
    message = _message(make_scenario, "reach")
    assert message == (
        "plug-in 'theirs' of dikbench.scenarios (theirs_module) cannot be imported: "
        "ImportError: no module named theirs"
    )


@pytest.mark.parametrize("kind", ["formulation", "scenario"])
def test_without_any_plugin_the_cure_is_given(install: Install, kind: str) -> None:
    """An uninstalled checkout is an error with its cure, never an empty table."""
    install("dikbench.nothing")
    make: Callable[[str], object] = make_formulation if kind == "formulation" else make_scenario
    message = _message(make, "reach")
    assert f"no {kind}s are registered" in message
    assert "pip install -e ." in message


@pytest.mark.parametrize("name", ["two words", "a[b]", "a,b", "a=b", "", 3, None])
def test_a_name_that_no_selector_could_say_is_an_error(install: Install, name: object) -> None:
    """Brackets, commas, blanks, nothing, or no text at all."""
    install("dikbench.formulations", theirs={name: DampedLeastSquares})
    assert "is not a name" in _message(make_formulation, "dls")


@pytest.mark.parametrize("build", [3, "dls", None])
def test_an_entry_that_cannot_be_called_is_named(install: Install, build: object) -> None:
    """A table holds classes, instances or functions."""
    install("dikbench.formulations", theirs={"theirs": build})
    assert _message(make_formulation, "theirs") == (
        "/somewhere/theirs.py: formulation 'theirs' is not callable"
    )


def test_a_formulation_without_velocity_is_an_error(install: Install) -> None:
    """The message says which method is missing, and in which file."""
    install("dikbench.formulations", theirs={"dict": dict})
    assert "'dict' has no method velocity(problem, solve)" in _message(make_formulation, "dict")


def test_a_family_must_return_a_scenario(install: Install) -> None:
    """The message says what it returned instead."""

    def nothing(seed: int = 0) -> None:
        """Return nothing at all."""

    install("dikbench.scenarios", theirs={"nothing": nothing})
    message = _message(make_scenario, "nothing")
    assert message.endswith("scenario 'nothing' returned NoneType, not a Scenario")
    assert message.startswith(__file__)


def test_a_family_without_seeds_takes_only_zero(install: Install) -> None:
    """A seed that would be ignored is an error, not a repetition."""

    def fixed() -> object:
        """One scenario."""
        return reach("planar3r")

    install("dikbench.scenarios", theirs={"fixed": fixed})
    assert make_scenario("fixed", 0).robot.name == "planar3r"
    assert _message(make_scenario, "fixed", 1) == "scenario family 'fixed' takes no seed; valid: 0"


def test_a_parameter_without_annotation_has_the_type_of_its_default(install: Install) -> None:
    """Plug-ins need not be annotated."""

    def plain(distance=0.1, robot="planar3r", acceleration=False, seed=0):  # type: ignore[no-untyped-def]  # noqa: ANN001, ANN202
        """Reach with other defaults."""
        return reach(robot, distance=distance, acceleration=acceleration, seed=seed)

    install("dikbench.scenarios", theirs={"plain": plain})
    scenario = make_scenario("plain[distance=0.05,acceleration=true]")
    assert scenario.robot.limits.acceleration is not None
    assert "distance='far' is not valid" in _message(make_scenario, "plain[distance=far]")
