"""The train split, which tuning may use, and the test split, which it must not use."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from types import MappingProxyType
from typing import Final

from dikbench.errors import DikbenchError
from dikbench.selector import Selector
from dikbench.study.identity import scenario_id

SPLITS: Final[Mapping[str, range]] = MappingProxyType(
    {"train": range(1, 100), "test": range(100, 1000)}
)
"""The seeds of each split; seed 0, the unperturbed case, is in neither."""


def check_split(
    name: str,
    split: str,
    scenarios: Sequence[Selector],
    seeds: Sequence[int],
    others: Sequence[Selector],
) -> None:
    """Check that a study uses seeds and scenarios of its split only.

    Args:
        name: name of the study.
        split: `train` or `test`.
        scenarios: selectors of its scenarios.
        seeds: its seeds.
        others: selectors of the scenarios of the other split.

    Raises:
        DikbenchError: if a seed or a scenario belongs to the other split, or to none.
    """
    allowed = SPLITS[split]
    for seed in seeds:
        if seed not in allowed:
            raise DikbenchError(
                f"study {name}: seed {seed} is not in the {split} split; "
                f"valid: {allowed.start} to {allowed.stop - 1}"
            )
    reserved = {scenario_id(scenario) for scenario in others}
    for scenario in scenarios:
        if scenario_id(scenario) in reserved:
            raise DikbenchError(
                f"study {name}: scenario {str(scenario)!r} belongs to the other split than {split}"
            )
