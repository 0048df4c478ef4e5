"""The train split and the test split share nothing, and a study is held to its own."""

from __future__ import annotations

from pathlib import Path

import pytest

from dikbench.errors import DikbenchError
from dikbench.plugins.building import make_scenario
from dikbench.selector import parse_selector
from dikbench.study.identity import scenario_id
from dikbench.study.plan import expand
from dikbench.study.split import SPLITS
from dikbench.study.study import Selection, Study, load_study, select


def test_the_splits_share_no_seed_and_neither_has_seed_zero() -> None:
    """What everybody looks at is in neither."""
    train, test = (set(SPLITS[name]) for name in ("train", "test"))
    assert train
    assert test
    assert not train & test
    assert 0 not in train | test


def test_the_shipped_studies_share_no_seed_and_no_scenario() -> None:
    """Nor a value of the parameter that makes a family hard."""
    train, test = load_study("train"), load_study("test")
    assert (train.split, test.split) == ("train", "test")
    assert set(train.seeds) <= set(SPLITS["train"])
    assert set(test.seeds) <= set(SPLITS["test"])
    ids = [{scenario_id(parse_selector(t)) for t in s.scenarios} for s in (train, test)]
    assert not ids[0] & ids[1]
    families = [{parse_selector(t).name for t in s.scenarios} for s in (train, test)]
    assert families[0] == families[1]


@pytest.mark.long
@pytest.mark.parametrize("name", ["train", "test"])
def test_both_splits_certify(name: str) -> None:
    """Every scenario builds, at every seed."""
    study = load_study(name)
    for scenario in study.scenarios:
        for seed in study.seeds:
            assert make_scenario(scenario, seed).steps > 0


@pytest.mark.parametrize("name", ["train", "test"])
def test_both_splits_expand_and_certify_in_turns(name: str) -> None:
    """Every scenario builds, at the first seed and at one of the others."""
    study = load_study(name)
    assert len(expand(study)) > 50
    others = [*study.seeds][1:]
    for number, scenario in enumerate(study.scenarios):
        assert make_scenario(scenario, others[number % len(others)]).steps > 0


def _changed(**changes: object) -> Study:
    selection = Selection(**changes)  # type: ignore[arg-type]
    return select(load_study("train"), selection, named=True)


@pytest.mark.parametrize(
    ("study", "parts"),
    [
        (_changed(seeds=(0,)), ["seed 0 is not in the train split", "valid: 1 to 99"]),
        (_changed(seeds=(100,)), ["seed 100 is not in the train split"]),
    ],
)
def test_a_seed_of_the_other_split_is_an_error(study: Study, parts: list[str]) -> None:
    """One line that says what is valid."""
    with pytest.raises(DikbenchError) as caught:
        expand(study)
    for part in parts:
        assert part in str(caught.value)


def test_a_scenario_of_the_other_split_is_an_error_however_it_is_spelt() -> None:
    """Defaults that are spelt out do not hide it."""
    scenario = load_study("test").scenarios[0]
    spelt = f"{scenario[:-1]},gain=5.0]"
    assert scenario_id(parse_selector(spelt)) == scenario_id(parse_selector(scenario))
    with pytest.raises(DikbenchError, match="belongs to the other split than train"):
        expand(_changed(scenarios=(spelt,)))


def test_an_unknown_split_lists_the_valid_ones(tmp_path: Path) -> None:
    """In the file of a study."""
    file = tmp_path / "mine.toml"
    head = 'description = "x"\nscenarios = ["reach"]\nsplit = "tune"\n'
    file.write_text(head + '[[cells]]\nformulations = ["pinv"]')
    with pytest.raises(DikbenchError, match='valid: "train" or "test"'):
        load_study(str(file))
