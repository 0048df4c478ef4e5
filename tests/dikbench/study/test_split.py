"""The train split and the test split share nothing, and a study is held to its own."""

from __future__ import annotations

from pathlib import Path

import msgspec
import pytest

from dikbench.errors import DikbenchError
from dikbench.study.plan import expand
from dikbench.study.selection import Selection, select
from dikbench.study.split import SPLITS, split_of
from dikbench.study.study import Study, load_study


def test_the_splits_share_no_seed_and_neither_has_seed_zero() -> None:
    """What everybody looks at is in neither."""
    train, test = (set(SPLITS[name]) for name in ("train", "test"))
    assert train
    assert test
    assert not train & test
    assert 0 not in train | test


def test_a_seed_has_the_split_of_its_number_at_any_attempt() -> None:
    """Attempt a at instance n has the seed n + 1000 a."""
    for name, numbers in SPLITS.items():
        for seed in (numbers[0], numbers[-1]):
            assert {split_of(seed + 1000 * attempt) for attempt in range(5)} == {name}
    assert split_of(0) is None
    assert split_of(3000) is None


def test_the_shipped_studies_share_no_instance() -> None:
    """Nor a seed; what is tuned on is also reported on."""
    cells: dict[str, set[tuple[str, int]]] = {}
    for name in ("train", "test"):
        study = load_study(name)
        assert study.split == name
        few = msgspec.structs.replace(study, scenarios=("reach", "near-miss", "hold-still"))
        cells[name] = {(str(p.trial.scenario), p.trial.seed) for p in expand(few)}
        assert {split_of(seed) for _, seed in cells[name]} == {name}
    assert not cells["train"] & cells["test"]
    assert {*load_study("train").scenarios} <= {*load_study("test").scenarios}


def _changed(**changes: object) -> Study:
    selection = Selection(scenarios=("reach",), **changes)  # type: ignore[arg-type]
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


def test_an_unknown_split_lists_the_valid_ones(tmp_path: Path) -> None:
    """In the file of a study."""
    file = tmp_path / "mine.toml"
    head = 'description = "x"\nscenarios = ["reach"]\nsplit = "tune"\n'
    file.write_text(head + '[[cells]]\nformulations = ["pinv"]')
    with pytest.raises(DikbenchError, match='valid: "train" or "test"'):
        load_study(str(file))
