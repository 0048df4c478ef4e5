"""Studies of drawn instances: what they run, and what is refused."""

from __future__ import annotations

from pathlib import Path
from typing import Any, Final

import pytest
from msgspec.structs import replace

from dikbench.errors import DikbenchError
from dikbench.plugins.finding import plugins
from dikbench.selector import parse_selector
from dikbench.study.instances import (
    accepted,
    draw,
    numbers_of,
)
from dikbench.study.plan import expand
from dikbench.study.selection import Selection, select
from dikbench.study.split import SPLITS
from dikbench.study.study import Study, folder_of, load_study

CHEAP = "reach"


def _study(**changes: Any) -> Study:
    selection = Selection(formulations=("pinv",), scenarios=(CHEAP,), instances=6)
    return select(load_study("quick"), replace(selection, **changes), named=False)


def test_a_study_runs_each_formulation_on_each_instance_once() -> None:
    """At its own seed; references and plants as ever; a fraction is a prefix in the same folder."""
    study = _study(references=("time", "path"), formulations=("pinv", "dls"))
    trials = [p.trial for p in expand(study)]
    assert len(trials) == 6 * 2 * 2
    cells = {(trial.scenario, trial.seed) for trial in trials}
    assert cells == set(accepted(draw(parse_selector(CHEAP), range(100, 106))))
    part = _study(references=("time", "path"), formulations=("pinv", "dls"), fraction=0.5)
    assert {p.id for p in expand(part)} < {p.id for p in expand(study)}
    assert folder_of(part) == folder_of(study)


@pytest.mark.parametrize(("fraction", "number"), [(0.001, 1), (0.1, 10), (0.29, 29), (1.0, 100)])
def test_a_fraction_is_the_first_numbers(fraction: float, number: int) -> None:
    """At least one."""
    study = replace(load_study("ensembles"), fraction=fraction)
    assert numbers_of(study) == range(100, 100 + number)


NOT_TUNED_ON: Final = {
    *("joint-limit-crossing", "joint-limit-approach", "workspace-boundary", "self-collision"),
    *("hexagon", "back-and-forth"),
}
"""Families of which no motion is known that does the task, and two of very long runs."""


@pytest.mark.parametrize(("split", "without"), [("train", NOT_TUNED_ON), ("test", set())])
def test_the_shipped_splits_draw_every_family_that_may_be_drawn(
    split: str, without: set[str]
) -> None:
    """Numbers from the beginning of their split."""
    study = load_study(split)
    assert sorted(study.scenarios) == sorted({*plugins("scenario")} - {"csv"} - without)
    assert study.split == split
    assert numbers_of(study)[0] == SPLITS[split].start


@pytest.mark.parametrize(
    ("changes", "part"),
    [
        ({"seeds": (1,)}, "instances or seeds"),
        ({"instances": 0, "fraction": 0.5}, "fraction is of instances"),
        ({"instances": 1000}, "valid: 1 to 900"),
    ],
)
def test_wrong_use_of_instances_is_an_error(changes: dict[str, Any], part: str) -> None:
    """One line."""
    with pytest.raises(DikbenchError, match=part):
        expand(_study(**changes))


@pytest.mark.parametrize(
    ("lines", "part"),
    [
        ("instances = 3\nseeds = [1]", "instances or seeds"),
        ("instances = 3\n[timing]\nreference = 'dls'", "not timed"),
        ("instances = -1", "instances"),
        ("instances = 2\nfraction = 2.0", "fraction"),
        ("fraction = 0.5", "fraction is of instances"),
    ],
)
def test_a_wrong_file_is_an_error_that_names_it(tmp_path: Path, lines: str, part: str) -> None:
    """In one line."""
    file = tmp_path / "mine.toml"
    top, _, table = lines.partition("[timing]")
    tail = f"[timing]{table}" if table else ""
    cells = '[[cells]]\nformulations = ["pinv"]\n'
    file.write_text(f'description = "x"\nscenarios = ["reach"]\n{top}\n{cells}{tail}')
    with pytest.raises(DikbenchError, match=part) as caught:
        load_study(str(file))
    assert str(file) in str(caught.value)
    assert "\n" not in str(caught.value)


def test_a_seed_in_place_of_instances_runs_the_scenarios_themselves() -> None:
    """Each option replaces an axis of the study."""
    study = select(load_study("train"), Selection(seeds=(3,), scenarios=(CHEAP,)), named=True)
    assert {(str(p.trial.scenario), p.trial.seed) for p in expand(study)} == {(CHEAP, 3)}
