from __future__ import annotations

import re
from collections.abc import Callable
from pathlib import Path

import pytest
from msgspec.structs import fields, replace

from dikbench.cli.describing import description
from dikbench.errors import DikbenchError
from dikbench.plugins.finding import plugins
from dikbench.scenario.oracle import ORACLES
from dikbench.selector import alternatives, parse_selector
from dikbench.solvers.catalogue.back_ends import parse_solver
from dikbench.study.explained import VALID
from dikbench.study.plan import expand
from dikbench.study.selection import Selection, select
from dikbench.study.study import (
    Cells,
    Study,
    TimingSettings,
    folder_of,
    load_study,
    shipped_studies,
)

MINIMAL = """
description = "a study"
scenarios = ["reach"]
[[cells]]
formulations = ["dls"]
"""

WriteStudy = Callable[[str], str]


@pytest.fixture
def write_study(tmp_path: Path) -> WriteStudy:
    """A function that writes a study file and returns its path."""

    def write(text: str) -> str:
        path = tmp_path / "mine.toml"
        path.write_text(text)
        return str(path)

    return write


def solvers_of(study: Study) -> dict[str, list[str]]:
    """The solvers with which each formulation runs."""
    found: dict[str, list[str]] = {}
    for planned in expand(study):
        solvers = found.setdefault(str(planned.trial.formulation), [])
        if str(planned.trial.solver) not in solvers:
            solvers.append(str(planned.trial.solver))
    return found


@pytest.mark.parametrize("name", shipped_studies())
def test_every_shipped_study_expands_to_trials_with_distinct_ids(name: str) -> None:
    """Each shipped study is valid, and no two of its trials are the same."""
    study = load_study(name)
    if study.instances:  # one of each family that is fast to build
        few = tuple(text for text in study.scenarios if text != "humanoid")
        study = replace(study, instances=1, scenarios=few)
    planned = expand(study)
    assert planned
    assert len({p.id for p in planned}) == len(planned)


@pytest.mark.parametrize("name", [name for name in shipped_studies()
                                  if load_study(name).description.startswith("All ")])  # fmt: skip
def test_a_study_of_all_formulations_has_every_one(name: str) -> None:
    """Those that are registered, peers apart; where their description counts them it is right."""
    study = load_study(name)
    texts = [text for cell in study.cells for text in cell.formulations]
    named = {parse_selector(text).name for text in texts}
    assert named - set(ORACLES) == {*plugins("formulation")}
    counted = re.match(r"All (\d+) formulations on (\d+) scenarios of (\d+) families", (
        study.description
    ))  # fmt: skip
    assert bool(counted) != bool(study.instances)
    if counted:
        scenarios = [each for text in study.scenarios for each in alternatives(text)]
        families = {each.name for each in scenarios}
        sizes = (len(plugins("formulation")), len(scenarios), len(families))
        assert tuple(int(number) for number in counted.groups()) == sizes


def test_quick_covers_laws_families_and_solvers() -> None:
    """The default study has six formulations, the oracle, six families and six QP solvers."""
    trials = [planned.trial for planned in expand(load_study("quick"))]
    formulations = {trial.formulation.name for trial in trials}
    families = {trial.scenario.name for trial in trials}
    assert formulations == {
        "oracle",
        "pinv",
        "dls",
        "nullspace",
        "qp",
        "lp-alpha",
        "lp-alpha-cvxpy",
    }
    assert families == {
        "reach",
        "near-miss",
        "joint-limit-crossing",
        "joint-limit-graze",
        "joint-limit-detour",
        "speed-sweep",
    }
    solvers = [parse_solver(trial.solver) for trial in trials if str(trial.formulation) == "qp"]
    assert len({solver.name for solver in solvers}) == 6
    assert {solver.interface for solver in solvers} == {"cold", "warm"}
    assert {trial.reference for trial in trials} == {"time", "path"}


def test_a_law_without_solver_runs_once_whatever_solvers_are_named() -> None:
    """Solvers multiply only the formulations that need one."""
    chosen = Selection(formulations=("dls", "qp"), solvers=("osqp", "daqp"))
    assert solvers_of(select(load_study("quick"), chosen, named=False)) == {
        "dls": ["none"],
        "qp": ["osqp", "daqp"],
    }


def test_a_formulation_alone_gets_the_default_solver() -> None:
    """Without a study and a solver, a law runs with the default solver of its kind of program."""
    chosen = Selection(formulations=("qp[damping=0.1]", "lp-alpha-cvxpy"))
    assert solvers_of(select(load_study("quick"), chosen, named=False)) == {
        "qp[damping=0.1]": ["daqp[then=clarabel]"],
        "lp-alpha-cvxpy": ["clarabel"],
    }


def test_a_formulation_of_a_named_study_keeps_its_solvers() -> None:
    """Naming a study and a formulation of it keeps the study's solvers for that formulation."""
    smoke = load_study("smoke")
    chosen = Selection(formulations=("qp[damping=0.1]",))
    assert solvers_of(select(smoke, chosen, named=True)) == {"qp[damping=0.1]": ["daqp", "osqp"]}


def test_a_pair_that_cannot_work_is_planned_with_its_reason() -> None:
    """A linear program through proxqp stays in the plan as a skipped cell that says why."""
    chosen = Selection(formulations=("lp-alpha",), solvers=("proxqp",), scenarios=("reach",))
    planned = expand(select(load_study("quick"), chosen, named=False))
    assert planned
    assert all("linear program" in p.skip for p in planned)


def test_selectors_stand_in_the_trial_as_they_were_given() -> None:
    """Defaults are neither added to nor removed; what means the same is run once."""
    chosen = Selection(
        formulations=("dls[damping=0.05]", "dls", "dls[damping=0.1]"),
        scenarios=("reach[robot=panda]", "reach"),
    )
    trials = [p.trial for p in expand(select(load_study("quick"), chosen, named=False))]
    assert {str(t.formulation) for t in trials} == {"dls[damping=0.05]", "dls[damping=0.1]"}
    assert {str(t.scenario) for t in trials} == {"reach[robot=panda]"}


@pytest.mark.parametrize(
    ("change", "expected"),
    [
        (("scenarios", "scenarioss"), ("scenarioss", "did you mean 'scenarios'", "valid: ")),
        (('["reach"]', '"reach"'), ("scenarios is a text; valid: a list of scenarios",)),
        (('["reach"]', "[]"), ("scenarios is empty; valid: a list of scenarios",)),
        (('["reach"]', "[1]"), ("scenarios[0] is a whole number; valid: a list of",)),
        (
            ("formulations", "formulation"),
            ("'formulation' of [cells]", "did you mean 'formulations'?", "solvers"),
        ),
        (('"dls"', '"dlss"'), ("dlss", "did you mean 'dls'")),
        (('"dls"', '"dls[damp=1]"'), ("damp", "valid: damping")),
        (('"reach"', '"reech"'), ("reech", "did you mean 'reach'")),
        (('"reach"', '"reach[distance=7]"'), ("distance=7", "must be 0.01 to 0.3")),
        (('"reach"', '"reach[robot=ur55]"'), ("ur55", "did you mean 'ur5'")),
        (
            ("description", "seeds = [-1]\ndescription"),
            ("seeds[0] is too small; valid: a list of",),
        ),
        (("description", 'plants = ["perfect"]\ndescription'), ("perfect", "plant")),
        (("description", "timing = 3\ndescription"), ("timing is a whole number; valid: a sec",)),
        (("description", "description = 3 #"), ("description is a whole number; valid: a text",)),
        (
            ("description", 'split = "dev"\ndescription'),
            ("split = 'dev' is not valid; valid: \"tr",),
        ),
        (("[[cells]]", "[cells]"), ("cells is a section; valid: tables [[cells]], each with",)),
        (('formulations = ["dls"]', "solvers = []"), ("cells[0].formulations is missing; valid",)),
        (('scenarios = ["reach"]', ""), ("scenarios is missing; valid: a list of scenarios",)),
        (("description", ""), ("TOML",)),
    ],
)
def test_a_malformed_study_is_one_line_that_says_what_and_where(
    write_study: WriteStudy, change: tuple[str, str], expected: tuple[str, ...]
) -> None:
    """Unknown keys, wrong types and unknown names give one line with what would be valid."""
    path = write_study(MINIMAL.replace(*change, 1))
    with pytest.raises(DikbenchError) as caught:
        expand(load_study(path))
    assert "\n" not in str(caught.value)
    assert f"study {Path(path).stem}" in str(caught.value).replace(str(Path(path).parent) + "/", "")
    for part in expected:
        assert part in str(caught.value)


_WRONG = ("3", "2.5", "true", "2020-01-01", "[[]]", "{x = 1}", '"x"', "[]", "[-1]", '["x"]')


@pytest.mark.parametrize("key", VALID)
def test_no_key_of_a_study_is_refused_in_the_words_of_a_library(
    write_study: WriteStudy, key: str
) -> None:
    """Whatever stands behind a key: it is named, with what is valid, in one line."""
    section, _, name = key.rpartition(".")
    whole = {
        "": 'scenarios = ["reach"]\ndescription = "x"\n[[cells]]\nformulations = ["dls"]\n',
        "cells": '[[cells]]\nformulations = ["dls"]\n',
        "timing": '[timing]\nreference = "dls"\n',
    }
    refused = 0
    for value in _WRONG:
        lines = [line for line in whole[section].splitlines() if not line.startswith(f"{name} =")]
        place = 1 if section else 0
        text = "\n".join([*lines[:place], f"{name} = {value}", *lines[place:]])
        if key == "cells":
            text = text.partition("[[cells]]")[0]
        base = 'description = "x"\nscenarios = ["reach"]\n' if section else ""
        cells = '[[cells]]\nformulations = ["dls"]\n' if section == "timing" else ""
        try:
            load_study(write_study(base + cells + text))
        except DikbenchError as error:
            said = str(error)
            refused += 1
            assert "\n" not in said
            assert not re.search(r"\$\.|Expected|Object|array|got `", said), said
            assert name in said, said
            assert "valid" in said or "did you mean" in said, said
    assert refused >= 4


def test_every_key_says_what_is_valid() -> None:
    """Those of the study and of its sections."""
    keys = {field.name for field in fields(Study)}
    keys |= {f"cells.{field.name}" for field in fields(Cells)}
    keys |= {f"timing.{field.name}" for field in fields(TimingSettings)}
    assert set(VALID) == keys


def test_a_study_that_is_not_there_names_the_shipped_ones() -> None:
    """An unknown study lists the studies that exist."""
    with pytest.raises(DikbenchError, match=r"quik.*did you mean 'quick'.*smoke"):
        load_study("quik")


@pytest.mark.parametrize("reference", ["qp", "oracle"])
def test_a_timing_reference_that_needs_a_solver_is_an_error(
    write_study: WriteStudy, reference: str
) -> None:
    """The formulation whose problems are replayed must be one that needs no solver."""
    path = write_study(MINIMAL + f'[timing]\nreference = "{reference}"\n')
    with pytest.raises(DikbenchError, match="must be a formulation that needs no solver"):
        expand(load_study(path))


def test_a_study_as_it_is_shown_is_a_study(write_study: WriteStudy) -> None:
    """What `dikbench show quick` prints can be saved and run."""
    assert load_study(write_study(description("quick"))).scenarios == load_study("quick").scenarios


@pytest.mark.parametrize(
    ("axis", "sweep", "named"),
    [
        ("formulations", "dls[damping=0.1|-1]", "'dls[damping=-1]'"),
        ("scenarios", "near-miss[robot=ur5,miss=0.02|7]", "'near-miss[robot=ur5,miss=7]'"),
        ("plants", "ideal[noise=1e-4|-3]", "'ideal[noise=-3]'"),
        ("solvers", "daqp[primal_tol=1e-6|x]", "'daqp[primal_tol=x]'"),
    ],
)
def test_a_bad_value_in_a_sweep_names_its_cell(axis: str, sweep: str, named: str) -> None:
    """The whole study is refused, in one line that says which of its cells is wrong."""
    given = {"formulations": ("qp",), "scenarios": ("reach",), axis: (sweep,)}
    with pytest.raises(DikbenchError) as caught:
        expand(select(load_study("quick"), replace(Selection(), **given), named=False))
    assert named in str(caught.value)
    assert "\n" not in str(caught.value)


def test_the_oracles_run_in_the_one_way_that_they_have() -> None:
    """Whatever plants and references are asked for; a slowed one may wait like any other."""
    chosen = Selection(
        formulations=("oracle", "slowed-oracle", "dls"),
        scenarios=("reach",),
        plants=("saturating",),
        references=("path",),
    )
    trials = [p.trial for p in expand(select(load_study("quick"), chosen, named=False))]
    assert {(str(t.formulation), str(t.plant), t.reference) for t in trials} == {
        ("oracle", "ideal", "time"),
        ("slowed-oracle", "ideal", "path"),
        ("dls", "saturating", "path"),
    }


def test_each_selection_has_a_folder_of_its_own() -> None:
    """The same one the same, in whatever order its parameters are; a named study has its name."""

    def folder(formulation: str, scenario: str = "reach", seeds: tuple[int, ...] = ()) -> str:
        chosen = Selection((formulation,), (scenario,), seeds=seeds)
        return folder_of(select(load_study("quick"), chosen, named=False))

    one = folder("dls[damping=0.1]", "reach[robot=ur5,distance=0.1]")
    assert one == folder("dls[damping=0.1]", "reach[distance=0.1,robot=ur5]")
    folders = {one, folder("dls"), folder("qp"), folder("dls", "step"), folder("dls", seeds=(1,))}
    assert len(folders) == 5
    assert all(re.fullmatch(r"selection-[0-9a-f]{8}", name) for name in folders)
    assert folder_of(load_study("quick")) == "quick"


@pytest.mark.parametrize("name", ["full", "quick", "smoke"])
def test_a_study_is_what_its_description_says(name: str) -> None:
    """Numbers of formulations (oracles are none), scenarios and families."""
    study = load_study(name)
    formulations = {parse_selector(f).name for cells in study.cells for f in cells.formulations}
    numbers = {
        "formulations": len(formulations - set(ORACLES)),
        "scenarios": len(study.scenarios),
        "families": len({parse_selector(text).name for text in study.scenarios}),
    }
    told = {what: int(n) for n, what in re.findall(r"(\d+) (\w+)", study.description)}
    assert {what: told[what] for what in numbers} == numbers
    everything = not set(plugins("formulation")) - formulations
    assert study.description.startswith("All") == everything


@pytest.mark.parametrize("axis", ["formulations", "scenarios", "plants", "solvers"])
def test_names_joined_by_a_comma_are_no_name(axis: str) -> None:
    """A comma belongs into brackets: several are given one by one."""
    with pytest.raises(DikbenchError, match=r"'dls,qp' is one name; valid: each .* on its own"):
        select(load_study("quick"), replace(Selection(), **{axis: ("dls,qp",)}), named=False)
