"""Solvers, plants, robots and metrics of other authors: found, named, refused, told apart."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
from makers.commands import in_process
from makers.plugins import Install
from makers.scenarios import error_of

from dikbench.metrics import METRICS, other_metrics
from dikbench.plugins import source
from dikbench.plugins.building import make_plant, make_scenario
from dikbench.results.reading import load_results
from dikbench.robots import load_robot
from dikbench.scenario.plant import Ideal
from dikbench.selector import parse_selector
from dikbench.solvers.catalogue.back_ends import parse_solver
from dikbench.study import identity
from dikbench.study.identity import scenario_id, trial_id
from dikbench.study.study import load_study
from dikbench.study.trial import Trial
from dikbench.user_code import module_from_file, names_code

MINE = '''
from dataclasses import dataclass
from typing import Annotated

import numpy as np

from dikbench.metrics import Metric
from dikbench.robots import CatalogueEntry, planar_arm
from dikbench.scenario import Plant, Range
from dikbench.solvers import Answer, SolverLibrary

@dataclass(frozen=True)
class Zero(SolverLibrary):
    """Answers with zero."""
    share: Annotated[float, Range(0.0, 1.0)] = 0.5
    def solve(self, program):
        return Answer(np.zeros(len(program.q)), True)

@dataclass(frozen=True)
class Half(Plant):
    """Applies a half."""
    def drive(self, v, v_before, limits, dt):
        return 0.5 * v

@dataclass(frozen=True)
class NoDrive(Plant):
    """Lacks its method."""

ARM = CatalogueEntry("an arm", lambda: planar_arm((0.5, 0.4), velocity_limits=(1.0, 1.0)), "tip",
                     (0.3, 1.0), None, "none", task_rows=(0, 1))
SHORT_START = CatalogueEntry("an arm", lambda: planar_arm((0.5, 0.4), velocity_limits=(1.0, 1.0)),
                             "tip", (0.3,), None, "none")
STEPS = Metric("my_steps", "", "low", float("inf"), "number of steps", lambda m: m.trace.steps)
TAKEN = Metric("position_error_rms_m", "m", "low", 1.0, "taken", lambda m: 0.0)
SPACED = Metric("my steps", "", "low", 1.0, "spaced", lambda m: 0.0)
NUMBER = 3
'''


CACHES: tuple[Any, ...] = (
    source.digest_of_file, source._imported, identity._solver, identity._formulation,
    identity._plant, scenario_id,
)  # fmt: skip


@pytest.fixture
def mine(tmp_path: Path) -> str:
    """A file with a plug-in of each kind, and some that are none."""
    path = tmp_path / f"mine_{tmp_path.name}.py"
    path.write_text(MINE)
    return str(path)


def test_each_kind_is_found_in_a_file(mine: str) -> None:
    """What was built is what the file says, with its parameters."""
    solver = parse_solver(f"{mine}:Zero[share=0.25]")
    assert (solver.settings["share"], solver.interface) == (0.25, "cold")
    assert parse_solver(f"daqp[then={mine}:Zero]").then is not None
    assert make_plant(f"{mine}:Half[delay=2]").delay == 2
    robot = load_robot(f"{mine}:ARM")
    assert (robot.name, robot.nv, robot.task_rows) == ("ARM", 2, (0, 1))
    assert make_scenario(f"reach[robot={mine}:ARM,duration=0.2]").robot.name == "ARM"
    assert [each.metric.name for each in other_metrics([f"{mine}:STEPS"])] == ["my_steps"]


def test_each_kind_is_found_by_the_name_of_an_entry_point(install: Install, mine: str) -> None:
    """A table in a module of another project; the shipped ones are still there."""
    held = module_from_file(mine)
    install("dikbench.solvers", theirs={"zero": held.Zero})
    assert parse_solver("zero").library is not None
    assert parse_solver("daqp").library is None
    install("dikbench.plants", theirs={"half": held.Half, "late": Ideal(delay=3)})
    assert type(make_plant("half")) is held.Half
    assert make_plant("late") == Ideal(delay=3)
    assert make_plant("ideal") == Ideal()
    install("dikbench.robots", theirs={"arm": held.ARM})
    assert load_robot("arm").nv == 2
    install("dikbench.metrics", theirs={"steps": held.STEPS})
    assert [each.metric for each in other_metrics(["steps"])] == [held.STEPS]
    finders: tuple[Callable[[str], object], ...] = (
        parse_solver, load_robot, make_plant, lambda name: other_metrics([name]),
    )  # fmt: skip
    for find in finders:
        assert "unknown" in error_of(find, "nosuch")


@pytest.mark.parametrize(
    ("kind", "find", "entry", "said"),
    [
        ("solver", parse_solver, 3, "is no class that is derived from dikbench.solvers.Solver"),
        ("robot", load_robot, Ideal, "is no dikbench.robots.CatalogueEntry"),
        ("plant", make_plant, 3, "is no class, nor an instance of one"),
        ("metric", lambda name: other_metrics([name]), 3, "is neither a dikbench.metrics.Metric"),
    ],
)
def test_an_entry_that_is_none_is_one_line(
    install: Install, kind: str, find: Callable[[str], object], entry: object, said: str
) -> None:
    """With the file of the table, the kind and the name."""
    install(f"dikbench.{kind}s", theirs={"theirs": entry})
    told = error_of(find, "theirs")
    assert said in told
    assert f"{kind} 'theirs'" in told
    assert "\n" not in told


def test_a_name_of_dikbench_is_not_taken(install: Install, mine: str) -> None:
    """Neither wins silently."""
    install("dikbench.solvers", theirs={"daqp": module_from_file(mine).Zero})
    assert "is called 'daqp' already; valid: another name" in error_of(parse_solver, "zero")
    install("dikbench.plants", theirs={"ideal": module_from_file(mine).Half})
    assert "two plug-ins are called 'ideal'" in error_of(make_plant, "ideal")


@pytest.mark.parametrize(
    ("find", "name", "said"),
    [
        (parse_solver, "Zero[share=7]", "share=7.0 must be 0 to 1"),
        (parse_solver, "Zero[share=x]", "share='x' is not valid; valid: a number, 0 to 1"),
        (parse_solver, "Zero[shar=1]", "did you mean 'share'?"),
        (parse_solver, "Zero[preset=high]", "unknown preset of solver"),
        (parse_solver, "Zero[interface=warm]", "valid: cold"),
        (parse_solver, "Half", "is no class that is derived from dikbench.solvers.SolverLibrary"),
        (parse_solver, "Nosuch", "unknown class 'Nosuch'"),
        (make_plant, "NoDrive", "has no method drive(v, v_before, limits, dt)"),
        (make_plant, "Zero", "is not derived from dikbench.scenario.Plant"),
        (load_robot, "SHORT_START", "robot"),
        (load_robot, "NUMBER", "is no dikbench.robots.CatalogueEntry"),
        (lambda name: other_metrics([name]), "TAKEN", "as one of dikbench; valid: another name"),
        (lambda name: other_metrics([name]), "SPACED", "is no name of a column"),
        (lambda name: other_metrics([name]), "ARM", "is neither a dikbench.metrics.Metric"),
    ],
)
def test_what_is_wrong_of_a_file_is_one_line(
    mine: str, find: Callable[[str], object], name: str, said: str
) -> None:
    """What, where, and what would have been valid."""
    told = error_of(find, f"{mine}:{name}")
    assert said in told
    assert "\n" not in told


def test_another_source_is_another_trial(mine: str) -> None:
    """Of a solver, a plant and a robot alike; a shipped one counts by its name alone."""
    path = Path(mine)
    other = path.with_name("other.py")
    other.write_text(MINE + "# changed\n")

    def ids(file: Path) -> list[str]:
        # The same names, so that the source alone differs.
        trials = (
            Trial.of("qp", "reach", f"{file}:Zero"),
            Trial.of("dls", "reach", "none", f"{file}:Half"),
            Trial.of("dls", f"reach[robot={file}:ARM]"),
        )
        return [trial_id(trial) for trial in trials]

    before = ids(path)
    assert ids(path) == before
    assert len({*before, *ids(other)}) == 6
    text = path.read_text()
    path.write_text(other.read_text())
    for cache in (module_from_file, *CACHES):
        cache.cache_clear()
    after = ids(path)
    assert all(a != b for a, b in zip(before, after, strict=True))
    path.write_text(text)


def test_names_of_code_in_files_are_told(mine: str) -> None:
    """A report runs none of it, wherever in a selector it stands."""
    for text in (f"{mine}:Zero", f"daqp[then={mine}:Zero]", f"reach[robot={mine}:ARM]"):
        assert names_code(parse_selector(text))
    assert not names_code(parse_selector("reach[robot=ur5]"))


def test_list_and_show_say_where_a_plug_in_is_from(install: Install, mine: str) -> None:
    """The file, beside the name."""
    held = module_from_file(mine)
    install("dikbench.solvers", theirs={"zero": held.Zero})
    assert f"zero      Answers with zero [{mine}]" in in_process("list", "solvers").output
    for name in ("Zero", "Half", "ARM", "STEPS"):
        done = in_process("show", f"{mine}:{name}")
        assert done.exit_code == 0, done.output
        assert mine in done.output


def test_a_study_names_them_and_keeps_their_rows(
    mine: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """In workers; with the metric in the table; a second run finds all done; recompute knows it."""
    monkeypatch.setattr("dikbench.report.write.write_report", lambda folder: "")
    study = tmp_path / "study.toml"
    study.write_text(
        'description = "mine"\n'
        f'scenarios = ["reach[robot={mine}:ARM,duration=0.1]"]\n'
        f'plants = ["{mine}:Half"]\nmetrics = ["{mine}:STEPS"]\n'
        f'[[cells]]\nformulations = ["qp"]\nsolvers = ["{mine}:Zero"]\n'
    )
    load_study(str(study))
    out = str(tmp_path / "out")
    done = in_process("run", str(study), "--out", out, "--jobs", "1")
    assert done.exit_code == 0, done.output
    trials = load_results(out).trials
    assert trials["my_steps"].tolist() == trials["steps"].tolist()
    assert trials.attrs["definitions"]["my_steps"] == "number of steps"
    assert (trials["verified_share"] < 1).all()  # zero is no optimum, and is rechecked
    again = in_process("run", str(study), "--out", out, "--jobs", "1")
    assert "1 of 1 trials are done" in again.output + (again.stderr or "")
    assert in_process("recompute", out, "--jobs", "1").exit_code == 0
    assert load_results(out).trials["my_steps"].notna().all()


def test_metrics_do_not_depend_on_what_is_installed(install: Install, mine: str) -> None:
    """One of an entry point is computed where it is asked for, as one of a file."""
    install("dikbench.metrics", theirs={"steps": module_from_file(mine).STEPS})
    assert "my_steps" not in METRICS
    assert other_metrics([]) == ()
