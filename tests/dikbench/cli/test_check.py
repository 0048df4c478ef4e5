"""`dikbench check`: which promises hold, a line each, and an exit code for scripts."""

from __future__ import annotations

from pathlib import Path

import pytest
from click.testing import CliRunner
from makers.few_states import few_states

from dikbench.cli import commands
from dikbench.testing import CHECKS, FAMILY_CHECKS

LAWS = '''
from dataclasses import dataclass
from typing import Annotated, ClassVar

import numpy as np

from dikbench.errors import CannotAnswer
from dikbench.problem import Parameters, Range


@dataclass(frozen=True)
class Still(Parameters):
    """Stands still, or moves its first joint at a speed.

    Source: a test.
    """

    speed: Annotated[float, Range(0.0, 1000.0, "rad/s")] = 0.0

    keeps: ClassVar[frozenset[str]] = frozenset({"velocity"})

    def velocity(self, problem, solve):
        v = np.zeros(problem.robot.nv)
        v[0] = self.speed
        return v


@dataclass(frozen=True)
class Mute(Still):
    """Promises two limits and answers nowhere."""

    keeps: ClassVar[frozenset[str]] = frozenset({"velocity", "position"})

    def velocity(self, problem, solve):
        raise CannotAnswer("no")


@dataclass
class Thawed:
    """Is not frozen."""

    def velocity(self, problem, solve):
        return np.zeros(problem.robot.nv)
'''

FAMILIES = '''
from dataclasses import dataclass, replace

from dikbench.scenario import Claim
from scenarios.reach import Reach


@dataclass(frozen=True, kw_only=True)
class Near(Reach):
    """Reach with the planar arm; `lie` gives it a claim that is false for every other seed."""

    robot: str = "planar3r"
    lie: bool = False

    def case(self, robot, change):
        case = super().case(robot, change)
        return replace(case, claims=(Claim("lie", self.lie * change.seed, at_most=0.5),))


@dataclass(frozen=True, kw_only=True)
class Raises(Reach):
    """Fails in the words of Python."""

    def case(self, robot, change):
        return 1 / 0
'''


def checked(*arguments: str) -> tuple[int, list[str]]:
    """The exit code and the lines of `dikbench check`."""
    done = CliRunner().invoke(commands, ["check", *arguments])
    return done.exit_code, done.output.splitlines()


@pytest.fixture
def plugins_file(tmp_path: Path) -> Path:
    """A file with laws and families, as a user writes it."""
    path = tmp_path / "mine.py"
    path.write_text(LAWS + FAMILIES)
    return path


def outcomes(lines: list[str]) -> dict[str, str]:
    """The outcome of each check by its name."""
    return {line[14:].partition(":")[0]: line[:14].strip() for line in lines}


def test_a_formulation_that_keeps_its_promises(plugins_file: Path) -> None:
    """Every check has a line; what is not promised is said to be so; exit code 0."""
    code, lines = checked(f"{plugins_file}:Still")
    found = outcomes(lines)
    assert code == 0
    assert len(found) == len(lines) == len(CHECKS)
    promises = {"position limits", "acceleration limits", "inequalities", "priority", "rows"}
    assert {name for name, outcome in found.items() if outcome == "not promised"} == promises
    assert {outcome for name, outcome in found.items() if name not in promises} == {"kept"}


def test_a_broken_promise_is_one_line_with_its_reason(plugins_file: Path) -> None:
    """Its parameters count; the others are still checked; exit code 1."""
    code, lines = checked(f"{plugins_file}:Still[speed=50]")
    assert code == 1
    assert len(lines) == len(CHECKS)
    (broken,) = [line for line in lines if line.startswith("BROKEN")]
    assert broken.startswith("BROKEN        velocity limits: panda, state 0 (")
    assert "joint 0 passes its velocity limit: 50 rad/s" in broken


def test_a_broken_declaration_ends_the_checks(plugins_file: Path) -> None:
    """What is not declared properly cannot be asked for more."""
    code, lines = checked(f"{plugins_file}:Thawed")
    assert code == 1
    assert len(lines) == 1
    assert lines[0].startswith("BROKEN        declaration: Thawed is not an instance of a class")


def test_another_solver_may_be_named() -> None:
    """One that cannot take the program is an error of the user: exit code 2, one line."""
    code, lines = checked("lp-alpha", "--solver", "proxqp")
    assert code == 2
    assert len(lines) == 2  # the declaration needs no solver
    assert lines[1].startswith("error: ")
    assert "cannot take a linear program" in lines[1]
    assert checked("qp", "--solver", "nosuch")[0] == 2


def test_a_family_that_keeps_its_contract(plugins_file: Path) -> None:
    """From a file as well; exit code 0."""
    code, lines = checked(f"{plugins_file}:Near[distance=0.05]")
    found = outcomes(lines)
    assert code == 0
    assert len(found) == len(FAMILY_CHECKS)
    assert set(found.values()) == {"kept"}


def test_a_family_whose_certificate_fails_for_a_seed(plugins_file: Path) -> None:
    """The seed and the claim stand in the line, once, and what was not checked; exit code 1."""
    code, lines = checked(f"{plugins_file}:Near[lie=true]")
    assert code == 1
    reason = "certificate of 'Near' failed: lie = 1, must be <= 0.5"
    assert f"BROKEN        certificate: seed 1: {reason}" in lines
    assert lines[-1] == (
        "not checked   parts, seeds, deterministic, picklable: for the same cause as certificate"
    )
    assert sum("lie" in line for line in lines) == 1


@pytest.mark.parametrize(
    ("selector", "cause"),
    [
        ("Near[robot=nowhere.urdf,frame=tip]", "robot file not found: nowhere.urdf"),
        ("Raises", "ZeroDivisionError: division by zero"),
        ("Mute", "no answer at any state; the last one, "),
    ],
)
def test_one_cause_is_named_once(plugins_file: Path, selector: str, cause: str) -> None:
    """Each check stands in one line; those that could not be made stand together in the last."""
    code, lines = checked(f"{plugins_file}:{selector}")
    assert code == 1
    (broken,) = [line for line in lines if cause in line]
    assert broken.startswith("BROKEN")
    first = broken[14:].partition(":")[0]
    assert lines[-1].startswith("not checked   ")
    assert lines[-1].endswith(f": for the same cause as {first}")
    alone = [line[14:].partition(":")[0] for line in lines[:-1]]
    together = lines[-1][14:].partition(":")[0].split(", ")
    every = FAMILY_CHECKS if selector != "Mute" else CHECKS
    assert len(alone) + len(together) == len(every)
    assert len({*alone, *together}) == len(every)


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["nosuch"], "unknown plug-in 'nosuch'"),
        (["lp-alhpa"], "did you mean 'lp-alpha'?"),
        (["reach", "--solver", "osqp"], "reach is a scenario family, which needs none"),
        (["reach[distance=9]"], "distance=9.0 must be 0.01 to 0.3"),
        (["nowhere.py:Law"], "file not found: nowhere.py"),
    ],
)
def test_what_cannot_be_checked_is_one_line(arguments: list[str], words: str) -> None:
    """With exit code 2, and what would be valid."""
    code, lines = checked(*arguments)
    assert code == 2
    assert len(lines) == 1
    assert words in lines[0]


def test_a_file_is_every_plug_in_of_it(plugins_file: Path) -> None:
    """Each under its name; one that is broken makes the exit code."""
    with few_states(1, 20):
        code, lines = checked(str(plugins_file))
    assert code == 1
    titles = [line for line in lines if line.endswith(":")]
    assert titles == [
        f"{kind} {plugins_file}:{name}:"
        for kind, name in (
            ("formulation", "Still"), ("formulation", "Mute"), ("formulation", "Thawed"),
            ("scenario", "Near"), ("scenario", "Raises"),
        )
    ]  # fmt: skip
    (plugins_file.with_name("empty.py")).write_text("x = 1\n")
    code, lines = checked(str(plugins_file.with_name("empty.py")))
    assert code == 2
    assert "holds nothing to check; valid: a formulation, a scenario family" in lines[0]
