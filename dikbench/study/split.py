"""The train split, which tuning may use, and the test split, which it must not use."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from types import MappingProxyType
from typing import Final

from dikbench.errors import DikbenchError
from dikbench.plugins.drawing import SEEDS_APART

SPLITS: Final[Mapping[str, range]] = MappingProxyType(
    {"train": range(1, 100), "test": range(100, SEEDS_APART)}
)
"""The seeds of each split, and the numbers of its instances; seed 0, the unperturbed case, is in
neither."""


def split_of(seed: int) -> str | None:
    """Return the split of a seed; that of a later attempt at an instance is its number's.

    Attempt a at instance n has the seed n + 1000 a (see `drawn_cell`).
    """
    number = seed % SEEDS_APART
    return next((name for name, numbers in SPLITS.items() if number in numbers), None)


def check_split(name: str, split: str, seeds: Sequence[int]) -> None:
    """Check that a study uses seeds of its split only.

    Args:
        name: name of the study.
        split: `train` or `test`.
        seeds: its seeds.

    Raises:
        DikbenchError: if a seed belongs to the other split, or to none.
    """
    allowed = SPLITS[split]
    for seed in seeds:
        if split_of(seed) != split:
            raise DikbenchError(
                f"study {name}: seed {seed} is not in the {split} split; "
                f"valid: {allowed.start} to {allowed.stop - 1}"
            )
