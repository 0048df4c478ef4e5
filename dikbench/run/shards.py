"""Shards of a study: parts that machines run which know nothing of each other."""

from __future__ import annotations

import re
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Final

from dikbench.errors import DikbenchError
from dikbench.plugins.source import digest
from dikbench.run.blocks import LEAST_ROWS, Engine, family_and_robot
from dikbench.selector import Selector
from dikbench.study.plan import PlannedTrial

WRITTEN: Final = re.compile(r"([0-9]{1,6})/([0-9]{1,6})")

WHOLE_SCENARIOS: Final = 8
"""A shard with so many scenarios of a family and robot has whole ones, so that none is built twice;
with fewer, shards would be too unequal."""


@dataclass(frozen=True)
class Shard:
    """One of the parts into which the trials of a study are divided.

    Attributes:
        number: which one, from 1.
        of: number of parts.
    """

    number: int = 1
    of: int = 1

    def __str__(self) -> str:
        """Write it as on a command line."""
        return f"{self.number}/{self.of}"


WHOLE: Final = Shard()
"""A study that is not divided."""


def parse_shard(text: str) -> Shard:
    """Read a shard, such as `1/4`.

    Raises:
        DikbenchError: if it is none.
    """
    found = WRITTEN.fullmatch(text)
    number, of = map(int, found.groups()) if found else (0, 0)
    if found is None or of == 0:
        raise DikbenchError(f"shard {text!r}: valid: NUMBER/PARTS, such as 1/4, 2/4, 3/4 and 4/4")
    if not 1 <= number <= of:
        raise DikbenchError(f"shard {text!r}: there is none; valid: 1/{of} to {of}/{of}")
    return Shard(number, of)


def trials_of_shard(
    planned: Sequence[PlannedTrial], shard: Shard, engine: Engine
) -> list[PlannedTrial]:
    """Choose the trials of a shard, by what they are alone: all machines divide a plan alike.

    The trials of each family and robot are divided into pieces, as equal as they can be, and the
    pieces go to the shards that have the fewest trials so far. In lockstep a piece has at least
    `LEAST_ROWS` trials, so that it still pays.

    Args:
        planned: all trials of a study.
        shard: which part.
        engine: how they run.
    """
    if shard == WHOLE:
        return list(planned)
    kinds: dict[object, list[PlannedTrial]] = {}
    for p in planned:
        kind = (*family_and_robot(p.trial.scenario), bool(p.skip))
        kinds.setdefault(kind, []).append(p)
    sizes = [0] * shard.of
    own: set[str] = set()
    for trials in sorted(kinds.values(), key=len, reverse=True):
        most = shard.of if engine == "alone" else max(1, len(trials) // LEAST_ROWS)
        pieces = sorted(_pieces(trials, min(shard.of, most)), key=len, reverse=True)
        emptiest = sorted(range(shard.of), key=sizes.__getitem__)
        for piece, place in zip(pieces, emptiest, strict=False):
            sizes[place] += len(piece)
            if place == shard.number - 1:
                own.update(p.id for p in piece)
    return [p for p in planned if p.id in own]


def _pieces(trials: Sequence[PlannedTrial], number: int) -> Iterator[list[PlannedTrial]]:
    """Divide trials of one family and robot into a number of pieces.

    Where whole scenarios are too few, trials are dealt out in an order that has to do with nothing:
    in the plan's, each piece could have formulations, plants or seeds of its own.
    """
    scenarios: dict[tuple[Selector, int], list[PlannedTrial]] = {}
    for p in trials:
        scenarios.setdefault((p.trial.scenario, p.trial.seed), []).append(p)
    if len(scenarios) >= WHOLE_SCENARIOS * number:
        each = list(scenarios.values())
        for k in range(number):
            part = each[k * len(each) // number : (k + 1) * len(each) // number]
            yield [p for of_scenario in part for p in of_scenario]
    else:
        shuffled = sorted(trials, key=lambda p: digest(str(p.trial)))
        for k in range(number):
            yield shuffled[k::number]
