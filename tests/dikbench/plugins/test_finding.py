"""Tables of plug-ins: how they are found, checked and built, and the errors of wrong ones."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import make_dataclass
from functools import partial
from pathlib import Path
from types import ModuleType
from typing import Annotated, Any, Literal

import pytest
from makers.plugins import Install, law_with
from makers.scenarios import error_of

from dikbench.parameters import Drawn
from dikbench.plugins.building import make_formulation, make_scenario
from dikbench.plugins.finding import plugins, scenario_plugin
from formulations.damped_least_squares import DampedLeastSquares
from formulations.pseudo_inverse import PseudoInverse
from scenarios.reach import Reach


def _laws(**table: Any) -> Mapping[str, Any]:
    return {name.replace("_", "-"): build for name, build in table.items()}


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
    assert "did you mean 'damping'?" in error_of(make_formulation, "soft[dampin=1]")


def test_the_parameters_that_an_instance_has_need_not_be_given(
    install: Install, tmp_path: Path
) -> None:
    """Also where the class itself has no default for them."""
    law: Any = make_formulation(law_with(tmp_path, "gain: float") + "[gain=2]")
    install("dikbench.formulations", theirs=_laws(ready=law))
    assert make_formulation("ready") == law


@pytest.mark.parametrize(
    ("kind", "base", "word"),
    [("formulation", DampedLeastSquares, "tuned"), ("scenario", Reach, "seed")],
)
def test_a_parameter_whose_name_selectors_use_is_refused(
    install: Install, kind: Literal["formulation", "scenario"], base: type, word: str
) -> None:
    """Where it is declared: no selector could give it a value."""
    theirs = make_dataclass(
        "Theirs", [(word, Annotated[bool, Drawn()], False)], bases=(base,), frozen=True
    )
    install(f"dikbench.{kind}s", theirs={"theirs": theirs})
    told = error_of(plugins, kind)
    assert f"{kind} 'theirs': a parameter cannot be called {word!r}" in told
    assert "valid: another name" in told
    assert "\n" not in told


def test_a_table_may_hold_a_family_with_its_parameters_set(install: Install) -> None:
    """As an instance or as a partial call; a selector still replaces what is set."""
    for entry in (Reach(robot="ur5", dt=0.05), partial(Reach, robot="ur5", dt=0.05)):
        install("dikbench.scenarios", theirs={"ur5-reach": entry})
        scenario = make_scenario("ur5-reach[dt=0.02]", seed=1)
        assert (scenario.robot.name, scenario.dt) == ("ur5", 0.02)
        assert make_scenario("ur5-reach").dt == 0.05
        assert scenario_plugin("ur5-reach").parameters["robot"].default == "ur5"
        assert scenario_plugin("ur5-reach").summary.startswith("A step to a target nearby")


@pytest.mark.parametrize(
    "entry", [partial(DampedLeastSquares, damping=0.2), partial(DampedLeastSquares, 0.2)]
)
def test_a_table_may_hold_partial_calls(install: Install, entry: object) -> None:
    """functools.partial sets parameters of a class, by name or by place."""
    install("dikbench.formulations", theirs=_laws(soft=entry))
    assert make_formulation("soft") == DampedLeastSquares(0.2)
    assert make_formulation("soft[damping=0.3]") == DampedLeastSquares(0.3)
    assert plugins("formulation")["soft"].parameters["damping"].default == 0.2


def test_two_plugins_of_one_name_are_an_error_that_names_both_files(install: Install) -> None:
    """Neither wins silently."""
    install(
        "dikbench.formulations",
        ours=_laws(dls=DampedLeastSquares),
        theirs=_laws(dls=PseudoInverse),
    )
    message = error_of(make_formulation, "dls")
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
    assert error_of(make_formulation, "dls") == (
        "plug-in 'builtin' of dikbench.formulations: /elsewhere/formulations/__init__.py holds no "
        "mapping FORMULATIONS; if it is not the plug-in's, a folder or module 'builtin_module' of "
        "yours hides it: valid: another name"
    )


def test_a_table_of_the_wrong_type_is_named(install: Install) -> None:
    """A list is no mapping."""
    module = ModuleType("theirs")
    module.FORMULATIONS = [DampedLeastSquares]  # type: ignore[attr-defined]
    install("dikbench.formulations", theirs=module)
    assert "holds no mapping FORMULATIONS" in error_of(make_formulation, "dls")


def test_a_plugin_that_cannot_be_imported_is_named(install: Install) -> None:
    """With the entry point, its module and the reason."""

    def load() -> ModuleType:
        raise ImportError("no module named theirs")

    install("dikbench.scenarios", theirs=load)
    message = error_of(make_scenario, "reach")
    assert message.startswith(
        "plug-in 'theirs' of dikbench.scenarios (theirs_module) cannot be imported: "
        "ImportError: no module named theirs"
    )


@pytest.mark.parametrize("kind", ["formulation", "scenario"])
def test_without_any_plugin_the_cure_is_given(install: Install, kind: str) -> None:
    """An uninstalled checkout is an error with its cure, never an empty table."""
    install("dikbench.nothing")
    make: Callable[[str], object] = make_formulation if kind == "formulation" else make_scenario
    message = error_of(make, "reach")
    assert f"no {kind}s are registered" in message
    assert "pip install -e ." in message


@pytest.mark.parametrize("name", ["two words", "a[b]", "a,b", "a=b", "", 3, None])
def test_a_name_that_no_selector_could_say_is_an_error(install: Install, name: object) -> None:
    """Brackets, commas, blanks, nothing, or no text at all."""
    install("dikbench.formulations", theirs={name: DampedLeastSquares})
    assert "is not a name" in error_of(make_formulation, "dls")


@pytest.mark.parametrize("build", [3, "dls", None])
def test_an_entry_that_is_no_class_is_named(install: Install, build: object) -> None:
    """A table holds classes, or instances of one."""
    install("dikbench.formulations", theirs={"theirs": build})
    assert error_of(make_formulation, "theirs") == (
        "/somewhere/theirs.py: formulation 'theirs' is no class, nor an instance of one"
    )


def test_a_formulation_without_velocity_is_an_error(install: Install) -> None:
    """The message says which method is missing, and in which file."""
    install("dikbench.formulations", theirs={"dict": dict})
    assert "'dict' has no method velocity(problem, solve)" in error_of(make_formulation, "dict")


def test_a_function_is_no_family(install: Install) -> None:
    """One line that says what is one, as for a class that is not derived from `Family`."""

    def mine(seed: int = 0) -> None:
        """Return nothing at all."""

    install("dikbench.scenarios", theirs={"mine": mine})
    assert error_of(make_scenario, "mine") == (
        "/somewhere/theirs.py: scenario 'mine' is no class, nor an instance of one"
    )
    install("dikbench.scenarios", theirs={"mine": DampedLeastSquares})
    assert error_of(make_scenario, "mine").endswith(
        "scenario 'mine' is not derived from dikbench.scenario.Family"
    )


def test_a_formulation_without_types_has_those_of_its_defaults(tmp_path: Path) -> None:
    """A plug-in's annotations need not be found: then numbers stay numbers, and words words."""
    selector = law_with(
        tmp_path, 'gain: Number = 1.0\n    careful: Flag = False\n    mode: Word = "fast"'
    )
    law: Any = make_formulation(f"{selector}[gain=0.5,careful=true,mode=slow]")
    assert (law.gain, law.careful, law.mode) == (0.5, True, "slow")
    assert "gain='far' is not valid" in error_of(make_formulation, f"{selector}[gain=far]")
