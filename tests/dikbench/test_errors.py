"""Errors in one line: names that are unknown, and where a plug-in failed."""

from __future__ import annotations

from pathlib import Path

import pytest
from makers.scenarios import error_of, run_on_planar

from dikbench.errors import LONGEST_CHARACTERS, in_words, unknown
from dikbench.plugins.building import make_formulation, make_scenario
from dikbench.testing.verdicts import verdicts_on_family


def test_few_names_are_all_listed() -> None:
    """Sorted, after the nearest one."""
    said = str(unknown("colour", "gren", ["red", "green"], "in the flag", "list colours"))
    assert said == "unknown colour 'gren' in the flag; did you mean 'green'? valid: green, red"
    assert str(unknown("colour", "red", [])) == "unknown colour 'red'; valid: none"


@pytest.mark.parametrize("name", ["metric_7", "nothing like it", ""])
def test_of_many_names_the_nearest_are_listed(name: str) -> None:
    """With their number and how to list them all."""
    every = [f"metric_{number}_of_many" for number in range(99)]
    said = str(unknown("metric", name, every, every="dikbench list metrics"))
    assert len(said) <= LONGEST_CHARACTERS
    assert said.endswith(" ... (99 in all, listed by `dikbench list metrics`)")
    assert sum(one in said.partition("valid: ")[2].split(", ") for one in every) == 5
    if name == "metric_7":
        assert "metric_7_of_many" in said.partition("valid: ")[2]


FILE = """from dataclasses import dataclass, replace
from dikbench.problem import Parameters
from dikbench.scenario import Case, Family, Variation, through
from scenarios.reach import Reach
import numpy as np


@dataclass(frozen=True)
class Law:
    how: str = "here"

    def velocity(self, problem, solve):
        return helper(problem) if self.how == "helper" else np.zeros(3) @ np.zeros((4, 4))


def helper(problem):
    return problem.nothing


@dataclass(frozen=True, kw_only=True)
class Divides(Reach):
    def case(self, robot, change):
        return 1 / 0


@dataclass(frozen=True, kw_only=True)
class Misuses(Reach):
    def case(self, robot, change):
        return through(None, None)


@dataclass(frozen=True, kw_only=True)
class GivesNothing(Reach):
    def case(self, robot, change):
        super().case(robot, change)


@dataclass(frozen=True, kw_only=True)
class HasNoCase(Family):
    pass


class Bare(Reach):
    pass


class Plain:
    gain: float = 1.0

    def velocity(self, problem, solve):
        return problem.q
"""


@pytest.fixture
def file(tmp_path: Path) -> Path:
    """A file with slips of authors."""
    path = tmp_path / "slips.py"
    path.write_text(FILE)
    return path


def line_of(text: str) -> int:
    """The number of the line in which a text stands."""
    (number,) = (k for k, line in enumerate(FILE.splitlines(), start=1) if text in line)
    return number


def test_an_error_of_a_law_has_its_file_and_line(file: Path) -> None:
    """The innermost line of the author's, not of NumPy or of dikbench, without folders."""
    for how, line in (("here", "np.zeros((4, 4))"), ("helper", "problem.nothing")):
        run = run_on_planar(make_formulation(f"{file}:Law[how={how}]"))
        assert run.status.value == "formulation-error"
        assert run.message.endswith(f" (slips.py, line {line_of(line)})")


@pytest.mark.parametrize(
    ("name", "said"),
    [
        ("Divides", f"ZeroDivisionError: division by zero (slips.py, line {line_of('1 / 0')})"),
        ("Misuses", f"(slips.py, line {line_of('through(None, None)')})"),
        ("GivesNothing", "case() returned NoneType; valid: a dikbench.scenario.Case"),
        ("HasNoCase", "slips.py: scenario 'HasNoCase' has no method case(robot, change)"),
        ("Bare", "class Bare: write @dataclass(frozen=True) above it"),
    ],
)
def test_a_slip_of_a_family_s_author_is_named(file: Path, name: str, said: str) -> None:
    """In words of ours, or with the line where Python gave up."""
    assert said in error_of(make_scenario, f"{file}:{name}")


def test_a_contract_says_the_line_too(file: Path) -> None:
    """Of each check that ended in an error."""
    from dikbench.plugins.building import make_family

    verdicts = [v for v in verdicts_on_family(make_family(f"{file}:Divides")) if v.reason]
    broken = [v.reason for v in verdicts if v.outcome == "BROKEN"]
    assert broken
    assert len(verdicts) > 3
    place = f"ZeroDivisionError: division by zero (slips.py, line {line_of('1 / 0')})"
    assert all(reason.endswith(place) for reason in broken)


def test_a_law_that_is_no_dataclass_is_named(file: Path) -> None:
    """Its annotations would not be parameters."""
    assert error_of(make_formulation, f"{file}:Plain").endswith(
        "formulation 'Plain': write @dataclass(frozen=True) above class Plain"
    )


@pytest.mark.parametrize(
    ("lines", "said"),
    [
        (
            "@dataclass\nclass T(Reach): ...",
            "TypeError: cannot inherit non-frozen dataclass from a frozen one (slip.py, line 4); "
            "valid: @dataclass(frozen=True) above the class",
        ),
        (
            "@dataclass(frozen=True)\nclass T(Reach):\n    variation = {'start': 0.1}",
            "class T: variation = {'start': 0.1} is not valid; valid: such as variation = "
            "Variation(start=0.1)",
        ),
        (
            "@dataclass(frozen=True)\nclass T(Reach):\n    robots = 'panda'",
            'class T: robots = \'panda\' is not valid; valid: such as robots = ("panda", "ur5")',
        ),
        (
            "@dataclass(frozen=True)\nclass T(Reach):\n    grid = ('distance',)",
            'class T: grid = (\'distance\',) is not valid; valid: such as grid = ("x", "y")',
        ),
        ("import nosuch_module", "ModuleNotFoundError: No module named 'nosuch_module' (slip.py, "),
        ("x = 1\ndef f(:", "SyntaxError: invalid syntax (slip.py, line 5)"),
        ("1 / 0", "ZeroDivisionError: division by zero (slip.py, line 4)"),
    ],
)
def test_a_file_that_cannot_be_imported(tmp_path: Path, lines: str, said: str) -> None:
    """One line: the file, the error, its line, what would be valid where that is known."""
    path = tmp_path / "slip.py"
    head = "from dataclasses import dataclass\nfrom scenarios.reach import Reach\n\n"
    path.write_text(head + lines)
    message = error_of(make_scenario, f"{path}:T")
    assert message.startswith(f"{path} cannot be imported: {said}")


def test_a_file_without_plugins_says_so(tmp_path: Path) -> None:
    """Where a class is missing from the name, and there is none to choose."""
    (tmp_path / "empty.py").write_text("class Other: ...\n")
    assert error_of(make_formulation, str(tmp_path / "empty.py")).endswith(
        "empty.py names a file without a class; valid: none, for it holds no formulation, no "
        "family and no plant"
    )


def test_an_error_without_a_line_of_an_author() -> None:
    """Has none; nor has an empty message a colon behind it."""
    assert in_words(ValueError("first\nsecond")) == "ValueError: first"
    assert in_words(KeyError()) == "KeyError"
