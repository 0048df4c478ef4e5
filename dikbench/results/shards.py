"""Which shards of its study a results folder has run, by the descriptions of its runs."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, Final

SHARD: Final = "shard"
TRIALS_OF_SHARD: Final = "trials_of_shard"
"""Entries of the description of a run of a shard: which one, and how many trials it has."""

MERGED: Final = "merged"
"""Entry of the description of merged results: for each folder, its name, its shards, its rows."""


def shards_in(runs: Sequence[Mapping[str, Any]]) -> dict[str, int]:
    """Return the shards of the last study that were run, with their numbers of trials.

    Args:
        runs: the descriptions of all runs, in their order.

    Returns:
        Nothing where the whole study was run, or begun.
    """
    last = runs[-1]
    same = [run for run in runs if all(run.get(k) == last.get(k) for k in ("study", "trials"))]
    found = {run.get(SHARD): int(run.get(TRIALS_OF_SHARD, 0)) for run in same}
    return {} if None in found else {str(shard): number for shard, number in found.items()}


def trials_to_run(runs: Sequence[Mapping[str, Any]]) -> int:
    """Return how many trials of the last study a folder is to have: those of its shards."""
    shards = shards_in(runs)
    return sum(shards.values()) if shards else int(runs[-1]["trials"])
